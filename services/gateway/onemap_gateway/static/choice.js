// Where the robot drives and why: the table "Why there?", and its letters on the map.

import { place } from "./format.js";
import { by, element, refill } from "./panels.js";

const KINDS = { detection: "detection", frontier: "frontier", go_to: "place", look_at: "view", outline: "walls", region: "region" };

// The name of an option, on the map and in the table.
export const letter = (index) => String.fromCharCode(65 + index);

const DRIVES = ["go_to", "look_at"]; // a place that a person chose: no goals were weighed

export function showChoice(search) {
  const weighed = search?.choice?.options.some(({ kind }) => !DRIVES.includes(kind));
  const choice = search?.active && weighed ? search.choice : null;
  by("choice-card").hidden = !choice;
  if (!choice) return;
  refill(by("choice-options"), choice.options, () => choice.options.map(row));
  by("choice-left-out").hidden = !choice.left_out;
  by("choice-left-out").textContent = `${choice.left_out} more were weighed.`;
}

function row(option, index) {
  const head = element("th", { text: `${letter(index)} ${KINDS[option.kind] ?? option.kind}` });
  head.scope = "row";
  head.append(element("small", { text: option.chosen ? "chosen" : `at ${place(option.xy_m)}` }));
  const [score, utility] = [option.score, option.utility].map((number) => (DRIVES.includes(option.kind) ? "" : number.toFixed(2)));
  const numbers = [score, `${option.travel_m.toFixed(1)} m`, utility];
  const cells = numbers.map((text) => element("td", { text }));
  return element("tr", { className: option.chosen ? "chosen" : "" }, [head, ...cells]);
}
