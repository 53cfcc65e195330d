// Small helpers for the document: text only, never markup, and only what has changed.

export const byId = (id) => document.getElementById(id);

/** Sets a text, if it is another one. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Shows or hides an element. */
export function show(element, isShown) {
  if (element.hidden === isShown) element.hidden = !isShown;
}

/** A new element with a class and children, which are elements or texts. */
export function make(name, className = "", ...children) {
  const element = document.createElement(name);
  if (className) element.className = className;
  element.append(...children);
  return element;
}

/** A number with so many decimals; a dash where it is not known. */
export function number(value, digits) {
  return typeof value === "number" && Number.isFinite(value) ? value.toFixed(digits) : "–";
}

/** A number, scaled, where it is known. */
export const scaled = (value, factor) => (typeof value === "number" ? value * factor : null);

/** A length of time in words. */
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${seconds.toFixed(0)} s`;
  if (seconds < 7200) return `${(seconds / 60).toFixed(0)} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}

/** Makes a list have these rows: `fill(row, item)` for each, `create()` for those that are missing. */
export function fillRows(parent, items, create, fill) {
  while (parent.children.length > items.length) parent.lastElementChild.remove();
  items.forEach((item, index) => {
    if (!parent.children[index]) parent.append(create());
    fill(parent.children[index], item, index);
  });
}

/** Makes a definition list have these pairs of name and text. */
export function fillValues(list, pairs) {
  fillRows(
    list,
    pairs,
    () => make("div", "", make("dt"), make("dd")),
    (row, [name, text]) => {
      setText(row.firstElementChild, name);
      setText(row.lastElementChild, text);
    },
  );
}

/** A row of buttons of which one is pressed; `choose` is called with its value. */
export function fillChoice(group, options, chosen, choose) {
  fillRows(
    group,
    options,
    () => make("button", "plain"),
    (button, { value, label }) => {
      button.type = "button";
      setText(button, label);
      button.setAttribute("aria-pressed", String(value === chosen));
      button.onclick = () => choose(value);
    },
  );
}
