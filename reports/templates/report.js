"use strict";
(() => {
  document.documentElement.classList.add("js");
  const data = JSON.parse(document.getElementById("data").textContent);
  const $ = (selector, root = document) => root.querySelector(selector);
  const $$ = (selector, root = document) => [...root.querySelectorAll(selector)];
  const choose = (select, options) => select.replaceChildren(...options.map(([text, value]) => new Option(text, value)));

  // ---- tables -------------------------------------------------------------------------------

  // An entry is [number or null, as shown, place, what is said beside it], as the tables on the Python side made it.
  const fill = (cell, [value, shown, place, said]) => {
    cell.dataset.v = value ?? "";
    cell.textContent = shown;
    cell.className = "n" + (place === 1 ? " best" : place === 2 ? " second" : place < 0 ? " aside" : "");
    const add = (kind, text) => {
      const words = document.createElement(kind);
      words.textContent = text;
      cell.append(words);
      return words;
    };
    if (said) cell.append(" "), add("small", said);
    if (place > 0) add("span", place === 1 ? " (best)" : " (second best)").className = "hidden";
  };

  const sort = (table, column, direction, size = (v) => v) => {
    const sign = direction === "descending" ? -1 : 1;
    const key = (row) => {
      const cell = row.cells[column];
      if (cell.dataset.v === undefined) return cell.textContent;
      return cell.dataset.v === "" ? NaN : size(Number(cell.dataset.v));
    };
    const isLast = (row) => row.matches(".unranked") || row.cells[column].matches(".aside");
    const rows = [...table.tBodies[0].rows].map((row) => ({ row, key: key(row), last: isLast(row) }));
    rows.sort((a, b) => {
      if (a.last !== b.last) return a.last ? 1 : -1; // not ranked: always below
      if (typeof a.key === "string") return sign * a.key.localeCompare(b.key);
      if (Number.isNaN(a.key) || Number.isNaN(b.key)) return Number.isNaN(a.key) - Number.isNaN(b.key);
      return sign * (a.key - b.key);
    });
    table.tBodies[0].append(...rows.map(({ row }) => row));
  };
  const heads = (table) => [...table.tHead.rows[0].cells];
  const sortBy = (table, head, direction, size) => {
    heads(table).forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", direction);
    sort(table, heads(table).indexOf(head), direction, size);
  };
  const sortAgain = (table) => {
    const head = heads(table).find((one) => one.hasAttribute("aria-sort"));
    if (head) sortBy(table, head, head.getAttribute("aria-sort"));
  };
  for (const table of $$("table.sortable")) {
    for (const head of heads(table)) {
      $("button", head).addEventListener("click", () =>
        sortBy(table, head, head.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending")
      );
    }
  }

  // ---- what is chosen for all tables --------------------------------------------------------

  const [score, threshold, region, reference] = ["#score", "#threshold", "#region", "#reference"].map((id) => $(id));
  const metricOf = (family) => family.replace("@", threshold?.value ?? "");
  const merits = { lower: (v) => v, higher: (v) => -v, zero: Math.abs }; // less is better of what these give
  const asideOf = (metric, where) => data.aside[metric][where] ?? [];
  const best = (metric, where) => {
    const means = data.means[metric][where];
    const known = data.references.filter((method) => means[method][0] !== null && !asideOf(metric, where).includes(method));
    const merit = merits[data.better[metric]];
    return known.reduce((a, b) => (merit(means[b][0]) < merit(means[a][0]) ? b : a), known[0]);
  };
  // A difference as shown, taken the other way round; what is exactly nothing stays +0.00.
  const turnText = (shown) => (/^[+-]/.test(shown) ? (shown[0] === "+" ? "-" : "+") + shown.slice(1) : shown);

  const showBest = (metric) => {
    const table = $("#best-table");
    const columns = heads(table);
    columns.forEach((head, i) => {
      if (!head.dataset.score) return;
      const name = metricOf(head.dataset.score);
      $("span", head).textContent = name;
      for (const row of table.tBodies[0].rows) fill(row.cells[i], data.means[name][region.value][row.dataset.method]);
      table.tFoot.rows[0].cells[i].textContent = data.counts[name][region.value];
    });
    table.tFoot.rows[0].cells[1].textContent = data.counts[metric][region.value];
    for (const row of table.tBodies[0].rows) fill(row.cells[1], data.ranks[metric][region.value][row.dataset.method]);
    const head = columns.find((one) => one.dataset.score === score.value);
    const better = data.better[metric];
    sortBy(table, head, better === "higher" ? "descending" : "ascending", better === "zero" ? Math.abs : undefined);
  };

  const showDifferences = (metric) => {
    const table = $("#real-table");
    if (!table) return;
    const other = reference.value || best(metric, region.value);
    const at = data.methods.indexOf(other);
    const turn = (v) => (v === null ? null : -v);
    const turnVerdict = (said) => ({ lower: "higher", higher: "lower" })[said] ?? said;
    const turned = (value, shown) => (value === 0 ? shown : turnText(shown));
    const rows = data.differences[metric][region.value].flatMap(([method, from, mean, low, high, scenes, ...shown]) => {
      if (from === at) return [{ method, mean, low, high, scenes, shown }];
      if (method !== at) return [];
      const back = [turned(mean, shown[0]), turned(high, shown[2]), turned(low, shown[1]), turned(mean, shown[3]), turnVerdict(shown[4])];
      return [{ method: from, mean: turn(mean), low: turn(high), high: turn(low), scenes, shown: back }];
    });
    const aside = asideOf(metric, region.value);
    rows.sort((a, b) => a.method - b.method);
    const ends = [0, ...rows.flatMap((r) => [r.mean ?? 0, r.low ?? 0, r.high ?? 0])];
    const [least, most] = [Math.min(...ends), Math.max(...ends)];
    const place = (value) => String(3 + (94 * ((value ?? 0) - least)) / (most - least || 1));
    const higher = data.better[metric] === "higher";
    const verdict = (r) => {
      if (aside.includes(other) || aside.includes(data.methods[r.method])) return data.silent;
      if (!["lower", "higher"].includes(r.shown[4])) return r.shown[4];
      return (r.shown[4] === "higher") === higher ? "better" : "worse";
    };
    $("#reference-name").textContent = other;
    table.tBodies[0].replaceChildren(
      ...rows.map((r) => {
        const row = document.createElement("tr");
        const head = document.createElement("th");
        head.scope = "row";
        head.textContent = data.methods[r.method];
        row.append(head);
        const interval = r.low === null ? "–" : `${r.shown[1]} .. ${r.shown[2]}`;
        const texts = [r.shown[0], interval, null, r.shown[3], String(r.scenes), verdict(r)];
        texts.forEach((text, i) => {
          const cell = row.insertCell();
          if (text !== null) cell.textContent = text;
          cell.className = text === null ? "wide" : i < 5 ? "n" : "";
        });
        const bar = document.createElement("div");
        bar.className = "effect";
        for (const [name, value] of [["low", r.low ?? r.mean], ["mean", r.mean], ["high", r.high ?? r.mean], ["zero", 0]]) {
          bar.style.setProperty(`--${name}`, place(value));
        }
        row.cells[3].append(bar);
        return row;
      })
    );
  };

  const showWhere = (metric) => {
    for (const row of $("#regions-table").tBodies[0].rows) {
      data.regions.forEach((name, i) => fill(row.cells[i + 1], data.means[metric][name][row.dataset.method]));
    }
    const counts = $("#regions-table").tFoot.rows[0].cells;
    data.regions.forEach((name, i) => (counts[i + 1].textContent = data.counts[metric][name]));
    const entries = data.scenes[metric][region.value];
    for (const row of $("#scenes-table").tBodies[0].rows) {
      entries[Number(row.dataset.index)].forEach((entry, i) => fill(row.cells[i + 1], entry));
    }
    ["#regions-table", "#scenes-table"].forEach((id) => sortAgain($(id)));
    for (const scene of $$("[data-scene]")) {
      for (const shown of $$(".score", scene)) {
        shown.textContent = entries[Number(scene.dataset.scene)][Number(shown.dataset.method)][1];
      }
    }
  };

  const show = () => {
    const metric = metricOf(score.value);
    const unit = data.units[metric];
    $$(".metric-name").forEach((name) => (name.textContent = metric));
    $$(".region-name").forEach((name) => (name.textContent = region.value));
    $$(".unit-name").forEach((name) => (name.textContent = unit ? `, ${unit}` : ""));
    showBest(metric);
    showDifferences(metric);
    showWhere(metric);
  };

  const filter = $("#filter");
  const showScenes = () => {
    const wanted = filter.value.trim().toLowerCase();
    const hits = data.asked.map((name) => name.toLowerCase().includes(wanted));
    for (const row of $("#scenes-table").tBodies[0].rows) row.hidden = !hits[Number(row.dataset.index)];
    for (const scene of $$("[data-scene]")) scene.hidden = !hits[Number(scene.dataset.scene)];
    const count = hits.filter(Boolean).length;
    $("#filtered").textContent = wanted ? `${count} of ${hits.length} shown; means stay over all` : "";
  };

  // A browser that comes back to the page keeps what was chosen: choose the start again.
  $$("form.choices").forEach((form) => form.reset());
  $$("form.choices").forEach((form) => form.addEventListener("submit", (event) => event.preventDefault()));
  [score, threshold, region].forEach((select) => select?.addEventListener("change", show));
  reference?.addEventListener("change", () => showDifferences(metricOf(score.value)));
  filter?.addEventListener("input", showScenes);

  // ---- maps: numbers from pictures, colours from numbers ------------------------------------

  const bytes = (hex) => Uint8Array.from(hex.match(/../g), (pair) => parseInt(pair, 16));
  const colors = Object.fromEntries(Object.entries(data.colors).map(([name, hex]) => [name, bytes(hex)]));
  const source = (scene, map) => $(`[data-scene="${scene}"] .picture[data-map="${map}"] img`);

  const pixels = async (img) => {
    await img.decode();
    const canvas = new OffscreenCanvas(img.naturalWidth, img.naturalHeight);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(img, 0, 0);
    return context.getImageData(0, 0, canvas.width, canvas.height);
  };

  // Disparities in pixels of the pair, NaN where there is none; the twin of encoding.Coding.encode.
  const numbers = async (scene, map) => {
    const { low, step, gain } = data.codings[scene];
    const { width, height, data: rgba } = await pixels(source(scene, map));
    const values = new Float32Array((width * height) / 2);
    for (let i = 0, k = 0, fine = 4 * values.length; i < values.length; i++, k += 4, fine += 4) {
      values[i] = rgba[k] ? low + step * (8 * (rgba[k] / gain - 1) + rgba[fine]) : NaN;
    }
    return { width, height: height / 2, values };
  };

  // One pixel of a layer: `of` and `other` are maps; other is the truth, or what is subtracted.
  const painter = (kind, scene, of, other, isTruth) => {
    const [from, to] = { disparity: data.codings[scene].ends, error: [0, data.worst], difference: [-data.worst, data.worst] }[kind];
    const period = Math.max(4, Math.floor(Math.max(of.width, of.height) / 36));
    return (x, y, out, k) => {
      const i = y * of.width + x;
      let value = of.values[i];
      if (kind === "error") value = Math.abs(value - other.values[i]);
      if (kind === "difference") value -= other.values[i];
      if ((kind === "error" && Number.isNaN(other.values[i])) || (isTruth && Number.isNaN(value))) {
        out[k] = out[k + 1] = out[k + 2] = data.unknown;
      } else if (Number.isNaN(value)) {
        out[k] = out[k + 1] = out[k + 2] = data.stripes[((x + y) % period) * 2 >= period ? 1 : 0];
      } else {
        const c = 3 * Math.round(255 * Math.min(1, Math.max(0, (value - from) / (to - from))));
        for (let j = 0; j < 3; j++) out[k + j] = colors[kind][c + j];
      }
      out[k + 3] = 255;
    };
  };

  const draw = (canvas, width, height, paint, stride = 1) => {
    canvas.width = Math.ceil(width / stride);
    canvas.height = Math.ceil(height / stride);
    const context = canvas.getContext("2d");
    const image = context.createImageData(canvas.width, canvas.height);
    for (let y = 0, k = 0; y < canvas.height; y++) {
      for (let x = 0; x < canvas.width; x++, k += 4) paint(x * stride, y * stride, image.data, k);
    }
    context.putImageData(image, 0, 0);
  };

  const THUMBNAIL = 260; // px
  const thumbnails = async () => {
    for (const section of $$("section[data-scene]")) {
      const scene = Number(section.dataset.scene);
      const truth = source(scene, "truth") && (await numbers(scene, "truth"));
      for (const button of $$(".picture:not([data-kind=view])", section)) {
        const { kind, map } = button.dataset;
        const of = map === "truth" ? truth : await numbers(scene, map);
        const canvas = document.createElement("canvas");
        draw(canvas, of.width, of.height, painter(kind, scene, of, truth, map === "truth"), Math.ceil(of.width / THUMBNAIL));
        button.append(canvas);
      }
    }
    document.documentElement.dataset.drawn = "";
  };

  // ---- one map, or two, at full size --------------------------------------------------------

  const dialog = $("#large");
  const [place, left, right, kind, wipe] = ["scene", "left", "right", "kind"].map((id) => $(`#large-${id}`)).concat($("#wipe"));
  const picture = $("#large-picture");
  const nameOf = (map) => (map === "truth" ? "truth" : map === "view" ? "reference view" : data.methods[map]);
  let opener = null;
  let layers = null; // {scene, left, right, truth, view}: what is decoded now

  const offer = () => {
    const kept = [left.value, right.value];
    const maps = $$(`[data-scene="${place.value}"] .picture img`).map((img) => img.closest("button").dataset.map);
    const options = maps.map((map) => [nameOf(map), map]);
    [left, right].forEach((select, i) => {
      choose(select, options);
      select.value = maps.includes(kept[i]) ? kept[i] : maps[0];
    });
    const hasTruth = maps.includes("truth");
    $("option[value=error]", kind).disabled = !hasTruth;
    if (!hasTruth && kind.value === "error") kind.value = "disparity";
  };
  const load = async () => {
    const [scene, a, b] = [Number(place.value), left.value, right.value];
    const get = (map) => (map === "view" ? pixels(source(scene, map)) : numbers(scene, map));
    const found = await Promise.all([get(a), get(b), source(scene, "truth") ? get("truth") : null]);
    if (scene !== Number(place.value) || a !== left.value || b !== right.value) return; // chosen anew meanwhile
    layers = { scene, maps: [a, b], of: found.slice(0, 2), truth: found[2] };
    redraw();
  };
  const redraw = () => {
    const { scene, maps, of, truth } = layers;
    const { width, height } = of[0];
    const difference = kind.value === "difference";
    const isMap = maps.map((map) => map !== "view");
    // the truth has no error, and the view no numbers: they stay what they are
    const sides = maps.map((map, i) => {
      if (map === "view") return (x, y, out, k) => out.set(of[i].data.subarray(4 * (y * width + x), 4 * (y * width + x) + 4), k);
      return painter(map === "truth" || difference ? "disparity" : kind.value, scene, of[i], truth, map === "truth");
    });
    const both = difference && isMap[0] && isMap[1];
    const at = Math.round((width * Number(wipe.value)) / 100);
    const together = both && painter("difference", scene, of[0], of[1], false);
    picture.parentElement.style.setProperty("--ratio", String(width / height));
    draw(picture, width, height, (x, y, out, k) => {
      if (together) return together(x, y, out, k);
      (x < at ? sides[0] : sides[1])(x, y, out, k);
      if (at > 0 && at < width && (x === at || x === at - 1)) out.fill(x === at ? 0 : 255, k, k + 3); // where the two meet
    });
    wipe.disabled = both;
    const words = maps.map((map, i) => {
      const what = map === "view" ? "" : map === "truth" || kind.value !== "error" ? "disparity, " : "error, ";
      const entry = map in data.methods && score ? data.scenes[metricOf(score.value)][region.value][scene][map] : null;
      return what + nameOf(map) + (entry ? ` (${metricOf(score.value)} ${region.value}: ${entry[1]})` : "");
    });
    $("#large-caption").textContent = both
      ? `${nameOf(maps[0])} minus ${nameOf(maps[1])}: purple where ${nameOf(maps[0])} is nearer, orange where it is farther`
      : difference
        ? "A difference needs a map on either side, not the reference view."
        : `left: ${words[0]} · right: ${words[1]}`;
    const shown = both ? "difference" : difference ? "disparity" : kind.value;
    const { ends, pair } = data.codings[scene];
    const ticks = {
      disparity: [ends[0], (ends[0] + ends[1]) / 2, ends[1]].map((v) => String(Number((v / pair).toPrecision(3)))),
      error: ["0", String(data.worst / 2), `≥ ${data.worst}`],
      difference: [`≤ −${data.worst}`, "0", `≥ ${data.worst}`],
    }[shown];
    $(".bar", dialog).className = `bar ${shown}`;
    $$(".scale span:not(.bar)", dialog).forEach((tick, i) => (tick.textContent = ticks[i]));
    $("#large-unit").textContent = shown === "disparity" ? "disparity, px per view step" : `${shown}, px of the pair`;
  };
  const enlarge = async (button) => {
    opener = button;
    const { map } = button.dataset;
    place.value = button.closest("[data-scene]").dataset.scene;
    offer();
    const others = [...right.options].map((option) => option.value);
    left.value = map;
    right.value = map !== "truth" && others.includes("truth") ? "truth" : (others.find((o) => o !== map && o !== "view") ?? others[0]);
    kind.value = button.dataset.kind === "error" ? "error" : "disparity";
    wipe.value = button.dataset.kind === "error" ? 100 : 50;
    $("#large-readout").textContent = "";
    dialog.showModal();
    wipe.focus();
    await load();
  };
  choose(place, data.asked.flatMap((name, i) => (data.codings[i] ? [[name, i]] : [])));
  $$(".picture").forEach((button) => button.addEventListener("click", () => enlarge(button)));
  place.addEventListener("change", () => (offer(), load()));
  [left, right].forEach((select) => select.addEventListener("change", load));
  kind.addEventListener("change", () => layers && redraw());
  wipe.addEventListener("input", () => layers && redraw());
  picture.addEventListener("pointermove", (event) => {
    if (!layers) return;
    const box = picture.getBoundingClientRect();
    const x = Math.min(picture.width - 1, Math.max(0, Math.floor(((event.clientX - box.left) / box.width) * picture.width)));
    const y = Math.min(picture.height - 1, Math.max(0, Math.floor(((event.clientY - box.top) / box.height) * picture.height)));
    const { pair, size } = data.codings[layers.scene];
    const zoom = size[0] / picture.width;
    const said = layers.maps.flatMap((map, i) => {
      if (map === "view") return [];
      const value = layers.of[i].values[y * picture.width + x];
      return [`${nameOf(map)} ${Number.isNaN(value) ? "–" : (value / pair).toFixed(2)}`];
    });
    $("#large-readout").textContent = `column ${Math.floor(x * zoom)}, row ${Math.floor(y * zoom)}: ${said.join(" · ")}`;
  });
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  dialog.addEventListener("close", () => opener?.focus());

  // ---- epipolar slices ----------------------------------------------------------------------

  const [sliceScene, sliceRow, sliceMethod] = ["scene", "row", "method"].map((id) => $(`#slice-${id}`));
  const stroke = (canvas, points, color, ends) => {
    const context = canvas.getContext("2d");
    const [width, height] = [canvas.width, canvas.height];
    const up = (d) => height * (1 - (d - ends[0]) / (ends[1] - ends[0]));
    for (const [wide, shade] of [[5, "#000"], [2.5, color]]) {
      context.beginPath();
      points.forEach((d, i) => {
        const before = points[i - 1];
        const joined = Math.abs(up(d) - up(before)) < height / 20; // a jump is no surface
        context[joined ? "lineTo" : "moveTo"]((width * i) / points.length, up(d));
        context.lineTo((width * (i + 1)) / points.length, up(d));
      });
      context.lineWidth = wide * devicePixelRatio;
      context.strokeStyle = shade;
      context.stroke();
    }
  };
  const showSlices = async () => {
    const scene = Number(sliceScene.value);
    const { pair, size } = data.codings[scene];
    const slice = data.slices[scene].find(({ row }) => row === Number(sliceRow.value));
    const method = data.methods[Number(sliceMethod.value)];
    const volume = slice.methods[method];
    const shown = [["#slice-similarity", slice.similarity]];
    if (volume) shown.push(["#slice-materiality", volume[0]], ["#slice-visibility", volume[1]]);
    $("#slice-volume").hidden = !volume;
    $("#slice-none").hidden = Boolean(volume);
    const maps = await Promise.all([["truth", "#fff"], [sliceMethod.value, "#ff9e3d"]].map(async ([map, color]) => {
      if (!source(scene, map)) return null;
      const { width, height, values } = await numbers(scene, map);
      const y = Math.min(height - 1, Math.floor(((slice.row + 0.5) * height) / size[1]));
      return { color, points: [...values.subarray(y * width, (y + 1) * width)].map((v) => v / pair) };
    }));
    for (const [id, { src, ends }] of shown) {
      $(id).src = src;
      const over = $(".over", $(id).parentElement);
      [over.width, over.height] = [over.clientWidth, over.clientHeight].map((side) => Math.round(side * devicePixelRatio));
      maps.forEach((map) => map && stroke(over, map.points, map.color, ends));
    }
    const view = source(scene, "view");
    await view.decode();
    const canvas = $("#slice-view");
    [canvas.width, canvas.height] = [view.naturalWidth, view.naturalHeight];
    const context = canvas.getContext("2d");
    context.drawImage(view, 0, 0);
    const y = Math.floor(((slice.row + 0.5) * canvas.height) / size[1]);
    context.fillStyle = "#000";
    context.fillRect(0, y - 2, canvas.width, 5);
    context.fillStyle = "#ff9e3d";
    context.fillRect(0, y - 1, canvas.width, 3);
  };
  const offerRows = () => {
    const rows = data.slices[Number(sliceScene.value)];
    choose(sliceRow, rows.map(({ row }) => [row, row]));
    const kept = sliceMethod.value;
    const known = data.methods.flatMap((name, i) => (source(sliceScene.value, i) ? [[name, i]] : []));
    choose(sliceMethod, known);
    const told = known.find(([name]) => rows[0].methods[name]) ?? known[0]; // one with a volume first
    if (known.some(([, i]) => String(i) === kept)) sliceMethod.value = kept;
    else if (told) sliceMethod.value = told[1];
    showSlices();
  };
  if (sliceScene) {
    choose(sliceScene, data.asked.flatMap((name, i) => (data.slices[i].length ? [[name, i]] : [])));
    sliceScene.addEventListener("change", offerRows);
    [sliceRow, sliceMethod].forEach((select) => select.addEventListener("change", showSlices));
  }
  thumbnails().then(() => sliceScene && offerRows());
})();
