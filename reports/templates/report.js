"use strict";
(() => {
  document.documentElement.classList.add("js");
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (selector, root = document) => root.querySelector(selector);
  const $$ = (selector, root = document) => [...root.querySelectorAll(selector)];

  // An entry is [number or null, as shown, place], as the tables on the Python side made it.
  const fill = (cell, [value, shown, place]) => {
    cell.dataset.v = value ?? "";
    cell.textContent = shown;
    cell.className = "n" + (place === 1 ? " best" : place === 2 ? " second" : "");
    if (place) {
      const words = document.createElement("span");
      words.className = "hidden";
      words.textContent = place === 1 ? " (best)" : " (second best)";
      cell.append(words);
    }
  };

  const sort = (table, column, direction) => {
    const sign = direction === "descending" ? -1 : 1;
    const key = (row) => {
      const cell = row.cells[column];
      if (cell.dataset.v === undefined) return cell.textContent;
      return cell.dataset.v === "" ? NaN : Number(cell.dataset.v);
    };
    const rows = [...table.tBodies[0].rows].map((row) => ({ row, key: key(row), last: row.matches(".unranked") }));
    rows.sort((a, b) => {
      if (a.last !== b.last) return a.last ? 1 : -1; // not ranked: always below
      if (typeof a.key === "string") return sign * a.key.localeCompare(b.key);
      if (Number.isNaN(a.key) || Number.isNaN(b.key)) return Number.isNaN(a.key) - Number.isNaN(b.key);
      return sign * (a.key - b.key);
    });
    table.tBodies[0].append(...rows.map(({ row }) => row));
  };
  const sortAgain = (table) => {
    const heads = [...table.tHead.rows[0].cells];
    const column = heads.findIndex((head) => head.hasAttribute("aria-sort"));
    if (column >= 0) sort(table, column, heads[column].getAttribute("aria-sort"));
  };
  for (const table of $$("table.sortable")) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) =>
      $("button", head).addEventListener("click", () => {
        const next = head.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", next);
        sort(table, column, next);
      })
    );
  }

  const metric = $("#best-metric");
  metric?.addEventListener("change", () => {
    const table = $("#best-table");
    const regions = Object.values(data.means[metric.value]);
    $("#best-name").textContent = metric.value;
    regions.forEach((_, i) => ($("small", table.tHead.rows[0].cells[i + 1]).textContent = data.units[metric.value]));
    for (const row of table.tBodies[0].rows) {
      regions.forEach((entries, i) => fill(row.cells[i + 1], entries[row.dataset.method]));
    }
    sortAgain(table);
  });

  const [sceneMetric, sceneRegion] = [$("#scenes-metric"), $("#scenes-region")];
  const showScenes = () => {
    const table = $("#scenes-table");
    const unit = data.units[sceneMetric.value];
    $("#scenes-name").textContent = `${sceneMetric.value} in ${sceneRegion.value}${unit ? ", " + unit : ""}`;
    const entries = data.scenes[sceneMetric.value][sceneRegion.value];
    for (const row of table.tBodies[0].rows) {
      entries[Number(row.dataset.index)].forEach((entry, i) => fill(row.cells[i + 1], entry));
    }
    sortAgain(table);
  };
  sceneMetric?.addEventListener("change", showScenes);
  sceneRegion?.addEventListener("change", showScenes);
  // A browser that comes back to the page keeps what was chosen: choose the start again.
  $$("form.choices").forEach((form) => form.reset());

  const dialog = $("#large");
  let at = null;
  const open = (picture) => {
    at = picture;
    const [from, to] = [$("img", picture), $("img", dialog)];
    to.src = from.src;
    to.alt = from.alt;
    to.className = from.alt.startsWith("Reference view") ? "photo" : "";
    const scores = $$("dl div", picture.closest("figure")).map((d) => $$("dt, dd", d).map((e) => e.textContent).join(" "));
    $("figcaption", dialog).textContent = from.alt + (scores.length ? `: total_bad_1 ${scores.join(" · ")} %` : "");
    if (!dialog.open) dialog.showModal();
  };
  const move = (step) => {
    const row = at.dataset.row;
    const wanted = step === "row" ? (row === "error" ? "disparity" : "error") : row;
    const scope = step === "row" ? at.closest("figure") : at.closest(".grid");
    const found = $$(`.picture[data-row="${wanted}"]`, scope);
    const next = step === "row" ? found[0] : found[(found.indexOf(at) + step + found.length) % found.length];
    if (next) open(next);
  };
  $$(".picture").forEach((picture) => picture.addEventListener("click", () => open(picture)));
  $$("[data-move]", dialog).forEach((button) =>
    button.addEventListener("click", () => move(button.dataset.move === "row" ? "row" : Number(button.dataset.move)))
  );
  dialog.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: "row", ArrowDown: "row" }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    move(step);
  });
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  dialog.addEventListener("close", () => at?.focus());
})();
