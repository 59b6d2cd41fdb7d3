// The leaderboard's filters and sorting. What is chosen stands in the address, to be shared.
(() => {
  "use strict";
  const form = document.querySelector("form.filters");
  if (!form) return; // a site without records
  const table = document.querySelector("table.board");
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const heads = [...table.tHead.rows[0].cells];
  const filters = ["scenario", "rate", "controller", "status"];
  const initial = heads.findIndex((head) => head.hasAttribute("aria-sort"));
  const sorting = { column: initial, down: false };
  const defaults = Object.fromEntries(filters.map((name) => [name, form.elements[name].value]));

  const value = (row, column) => {
    const cell = row.cells[column];
    const text = cell.dataset.sort ?? cell.textContent.trim();
    if (heads[column].dataset.kind === "text") return text.toLowerCase();
    return text === "" ? null : Number(text);
  };

  const compare = (a, b) => {
    if (a === b) return 0;
    if (a === null) return 1; // what has no figure stands last, whichever way
    if (b === null) return -1;
    return (a < b ? -1 : 1) * (sorting.down ? -1 : 1);
  };

  const sort = () => {
    const keyed = rows.map((row) => [value(row, sorting.column), row]);
    keyed.sort(([a], [b]) => compare(a, b)); // stable: equal ones stay in the records' order
    body.append(...keyed.map(([, row]) => row));
    heads.forEach((head, index) => {
      if (index !== sorting.column) head.removeAttribute("aria-sort");
      else head.setAttribute("aria-sort", sorting.down ? "descending" : "ascending");
    });
  };

  const variants = form.elements.variants; // a box, where there are any

  const fits = (row) =>
    (variants?.checked || !("variant" in row.dataset) || row.dataset.controller === form.elements.controller.value) &&
    filters.every((name) => {
      const wanted = form.elements[name].value;
      const own = row.dataset[name];
      if (!wanted) return true;
      return name === "controller" ? own.toLowerCase().includes(wanted.toLowerCase()) : own === wanted;
    });

  const filter = () => {
    let shown = 0;
    for (const row of rows) {
      row.hidden = !fits(row);
      shown += !row.hidden;
    }
    table.classList.toggle("one-scenario", form.elements.scenario.value !== "");
    table.classList.toggle("one-rate", form.elements.rate.value !== "");
    document.querySelector(".nothing").hidden = shown > 0;
    form.querySelector("output").textContent = `${shown} of ${rows.length} rows`;
  };

  const remember = () => {
    const said = new URLSearchParams();
    for (const name of filters) {
      const chosen = form.elements[name].value;
      if (chosen !== defaults[name]) said.set(name, chosen);
    }
    if (variants?.checked) said.set("variants", "1");
    if (sorting.column !== initial || sorting.down) {
      said.set("sort", `${sorting.column}${sorting.down ? "-down" : ""}`);
    }
    history.replaceState(null, "", `#${said}`);
  };

  const recall = () => {
    const said = new URLSearchParams(location.hash.slice(1));
    for (const name of filters) {
      const field = form.elements[name];
      field.value = said.get(name) ?? defaults[name];
      if (field.selectedIndex === -1) field.value = defaults[name]; // an address of another site
    }
    if (variants) variants.checked = said.get("variants") === "1";
    const [, column, down] = /^(\d+)(-down)?$/.exec(said.get("sort") ?? "") ?? [];
    const known = heads[Number(column)]?.dataset.kind !== undefined;
    sorting.column = known ? Number(column) : initial;
    sorting.down = known && Boolean(down);
  };

  heads.forEach((head, index) => {
    if (!head.dataset.kind) return;
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      sorting.down = sorting.column === index && !sorting.down;
      sorting.column = index;
      sort();
      remember();
    });
  });

  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("input", () => {
    filter();
    remember();
  });
  window.addEventListener("hashchange", () => {
    recall();
    filter();
    sort();
  });
  recall();
  filter();
  if (sorting.column !== initial || sorting.down || form.elements.scenario.value === "") sort();
  else heads[initial].setAttribute("aria-sort", "ascending");
})();
