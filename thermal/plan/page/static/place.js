// The place of a building, by the name of a city or by coordinates.

import * as api from "./api.js";
import { byId, el, field } from "./dom.js";
import { measured } from "./units.js";

const now = { text: "", places: null, trouble: "" };

export function placeFinder(chosen, off) {
  const find = async () => {
    try {
      now.places = (await api.get("api/places", { name: now.text })).places;
      now.trouble = now.places.length ? "" : "No city of that name is known here. Type latitude and longitude as maps show them, such as 48.14, 11.58.";
    } catch (error) {
      now.places = null;
      now.trouble = error.message;
    }
    draw();
  };
  const input = el("input", { type: "text", id: "place", value: now.text, autocomplete: "off", disabled: off, placeholder: "Berlin, or 48.14, 11.58", oninput: (e) => { now.text = e.target.value; }, onkeydown: (e) => { if (e.key === "Enter") { e.preventDefault(); find(); } } });
  const found = el("div", { id: "places" });
  const draw = () => {
    const box = byId("places") || found;
    box.replaceChildren(...(now.places || []).map(({ name, ...site }) => el("button", { type: "button", class: "place", onclick: () => { now.places = null; now.trouble = ""; chosen(site); } },
      el("strong", {}, name), el("span", {}, ` ${site.latitude}°, ${site.longitude}°, ${site.timezone}, about ${measured(site.elevation, "m", 0)} above the sea (a coarse map: correct it below)`))), now.trouble ? el("p", { class: "soft" }, now.trouble) : "");
  };
  queueMicrotask(draw);
  return el("div", { class: "finder" }, el("div", { class: "row" }, field("Place: a city, or latitude and longitude", input), el("button", { type: "button", id: "find-place", disabled: off, onclick: find }, "Find")), found);
}
