// Display units: the case is kept in SI units, what is read and typed here is in those that the reader has chosen.

import * as api from "./api.js";

const KEPT = "buildingmpc-units"; // "ip": inch-pound
let known = null, lines = {}; // by SI unit: scale, offset and unit of what it is read in; none in SI units

export const chosen = () => localStorage.getItem(KEPT) || "si";

const lineOf = (unit) => lines[unit.replace("^2", "²")];

export const unitOf = (unit) => lineOf(unit)?.unit || unit;

// Numbers of fields keep what was typed: conversion there and back is not seen in six digits.
export function shown(value, unit) {
  const line = lineOf(unit);
  return value === null || value === undefined || value === "" || !line ? value : Number((line.scale * value + line.offset).toPrecision(6));
}

export function typed(value, unit) {
  const line = lineOf(unit);
  return value === null || value === "" || !line ? value : (value - line.offset) / line.scale;
}

export const measured = (value, unit, digits = 1) => `${shown(value, unit).toFixed(digits)} ${unitOf(unit)}`;

const NUMBER = "[+−-]?(?:\\d{1,3}(?:[ \\u202f]\\d{3})+(?!\\d)|\\d+)(?:\\.\\d+)?";
let quantities = null; // a number with its unit, or several that share one

// A sentence of the server, which is in SI units, with as many digits and at least two.
export function told(text) {
  if (!quantities || !text) return text;
  const number = (line) => (found) => {
    const plain = found.replace(/[ \u202f]/g, "").replace("−", "-"), value = line.scale * Number(plain) + line.offset;
    const decimals = plain.split(".")[1]?.length || 0, figures = plain.replace(/\D/g, "").replace(/^0+/, "");
    const digits = Math.max(2, (decimals ? figures : figures.replace(/0+$/, "")).length);
    return line.offset ? value.toFixed(decimals) : value.toLocaleString("en", { maximumSignificantDigits: digits }).replaceAll(",", " ");
  };
  return text.replace(quantities, (all, numbers, space, unit) => `${numbers.replace(new RegExp(NUMBER, "g"), number(lines[unit]))}${space}${lines[unit].unit}`);
}

export async function load() {
  if (chosen() === "ip" && !known) known = await api.get("api/units");
  lines = chosen() === "ip" ? known : {};
  const names = Object.keys(lines).sort((a, b) => b.length - a.length).map((name) => name.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
  quantities = names.length ? new RegExp(`(?<![\\w.:/-])(${NUMBER}(?:(?: to | and | or )${NUMBER})*)([ \\u00a0])(${names.join("|")})(?![\\w/²³·°^*])`, "g") : null;
}

export async function turn() {
  localStorage.setItem(KEPT, chosen() === "ip" ? "si" : "ip");
  try {
    await load();
  } catch (error) {
    localStorage.setItem(KEPT, "si");
    throw error;
  }
}
