// Small helpers of the page: elements, toasts, one dialog.

import { told } from "./units.js";

export const byId = (id) => document.getElementById(id);

// el("button", {class: "x", onclick: f}, "text", child)
export function el(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "selected") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export function toast(text, kind = "") {
  const note = el("p", { class: `toast ${kind}` }, told(text), el("button", { type: "button", title: "Dismiss", onclick: () => note.remove() }, "×"));
  byId("toasts").append(note);
  setTimeout(() => note.remove(), kind === "error" ? 12000 : 4000);
}

export function field(label, input, message = "") {
  const id = input.id || `f${Math.random().toString(36).slice(2)}`;
  input.id = id;
  if (message) {
    input.setAttribute("aria-invalid", "true");
    input.setAttribute("aria-describedby", `${id}-m`);
  }
  return el("div", { class: "field" }, el("label", { for: id }, label), input, message && el("p", { class: "message", id: `${id}-m` }, told(message)));
}

export function select(options, value, attributes = {}) {
  const box = el("select", attributes, options.map(([key, text]) => el("option", { value: key }, text)));
  box.value = value;
  return box;
}

export function openDialog(title, content, { wide = false } = {}) {
  const dialog = byId("dialog");
  const close = el("button", { type: "button", class: "close", title: "Close (Esc)", onclick: () => dialog.close() }, "×");
  dialog.className = wide ? "wide" : "";
  dialog.replaceChildren(el("div", { class: "head" }, el("h2", { id: "dialog-title" }, title), close), el("div", { class: "body" }, content));
  if (!dialog.open) dialog.showModal();
  return dialog;
}

export const closeDialog = () => byId("dialog").close();

// Tabs by arrow keys, as the ARIA authoring practices have it.
export function arrowTabs(list, choose) {
  list.addEventListener("keydown", (event) => {
    const tabs = [...list.querySelectorAll("[role=tab]")], now = tabs.indexOf(document.activeElement);
    const step = { ArrowRight: 1, ArrowLeft: -1, Home: -now, End: tabs.length - 1 - now }[event.key];
    if (step === undefined || now < 0) return;
    event.preventDefault();
    event.stopPropagation();
    const next = tabs[(now + step + tabs.length) % tabs.length];
    choose(next);
    [...list.querySelectorAll("[role=tab]")].find((tab) => tab.id === next.id)?.focus();
  });
}
