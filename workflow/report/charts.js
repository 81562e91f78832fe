"use strict";
// Chart primitives: lines with bands and error bars (uPlot), a forest plot (SVG), a heat map (canvas).
// Every chart registers itself in `drawn`, and the page's self-check looks at their pixels afterwards.
const drawn = [];
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const palette = i => css("--c" + (i % 6));
const isNumber = v => typeof v === "number" && isFinite(v);

function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "class") node.className = value;
    else if (key === "html") node.innerHTML = value;
    else node.setAttribute(key, value);
  }
  for (const child of children.flat()) if (child !== null && child !== undefined) node.append(child);
  return node;
}

function withAlpha(color, alpha) {
  const n = parseInt(color.slice(1), 16);
  return `rgba(${n >> 16}, ${(n >> 8) & 255}, ${n & 255}, ${alpha})`;
}

// 1.25e-10 -> "1.25", with the digits the error allows
function digits(value, sigma) {
  if (!isNumber(value)) return "–";
  if (!(sigma > 0)) return Number(value.toPrecision(3)).toString();
  const places = Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(sigma))));
  return value.toFixed(places);
}
const superscript = n => String(n).replace(/[-0-9]/g, c => c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]);
function scientific(value, figures = 3) {
  if (!isNumber(value)) return "–";
  if (value === 0) return "0";
  const power = Math.floor(Math.log10(Math.abs(value)));
  if (power >= -3 && power < 5) return Number(value.toPrecision(figures)).toString();
  return Number((value / 10 ** power).toPrecision(figures)) + " × 10" + superscript(power);
}
function tick(value) {
  const size = Math.abs(value);
  if (value === 0) return "0";
  if (size >= 1e5 || size < 1e-3) {
    const power = Math.floor(Math.log10(size) + 1e-9), lead = Number((value / 10 ** power).toPrecision(3));
    return (lead === 1 ? "" : lead + "·") + "10" + superscript(power);
  }
  return Number(value.toPrecision(6)).toString();
}

// On every figure whose trajectories failed the artefact gate: for which of them.
const failedBadge = names => names ? el("div", {class: "failed", title: names}, "artefact gate failed: " + names) : null;

// spec: {title, note, x: {label, scale, log}, y: {label, scale, log, range}, marks: [{from, to, label}],
//        series: [{name, x, y, lo, hi, sigma, color, dash, width, points, line}], hlines: [{at, label}]}
function lineChart(parent, spec) {
  const xs = spec.x.scale || 1, ys = spec.y.scale || 1;
  const card = el("div", {class: "card chart"}, failedBadge(spec.failed), el("h3", {}, spec.title));
  if (spec.note) card.append(el("p", {class: "note"}, spec.note));
  const legend = el("div", {class: "legend"}), box = el("div"), readout = el("div", {class: "readout"}, " ");
  card.append(legend, box, readout);
  parent.append(card);

  const keep = (v, log) => isNumber(v) && (!log || v > 0);
  const tables = [], options = [{label: spec.x.label}], bands = [], bars = [];
  let column = 0;
  spec.series.forEach((s, i) => {
    const color = s.color || palette(i);
    const rows = s.x.map((x, k) => [x * xs, s.y[k] * ys, k]).filter(r => keep(r[0], spec.x.log) && keep(r[1], spec.y.log))
                    .sort((a, b) => a[0] - b[0]);
    if (!rows.length) return;
    const table = [rows.map(r => r[0]), rows.map(r => r[1])];
    const lo = s.lo || (s.sigma && s.points ? null : s.sigma && s.y.map((y, k) => y - s.sigma[k]));
    const hi = s.hi || (s.sigma && s.points ? null : s.sigma && s.y.map((y, k) => y + s.sigma[k]));
    const base = ++column;
    options.push({label: s.name, stroke: s.line === false ? "transparent" : color, width: s.width || 2, dash: s.dash,
                  points: {show: !!s.points, size: 7, fill: color, stroke: color}, spanGaps: true});
    if (lo && hi) {
      const floor = v => spec.y.log ? Math.max(v, 1e-300) : v;
      table.push(rows.map(r => isNumber(hi[r[2]]) ? hi[r[2]] * ys : null),
                 rows.map(r => isNumber(lo[r[2]]) ? (spec.y.log && lo[r[2]] <= 0 ? r[1] / 3 : floor(lo[r[2]] * ys)) : null));
      for (let k = 0; k < 2; ++k) { options.push({stroke: "transparent", width: 0, points: {show: false}, spanGaps: true}); ++column; }
      bands.push({series: [base + 1, base + 2], fill: withAlpha(color, .18)});
    } else if (s.sigma && s.points) {
      bars.push({rows: rows.map(r => [r[0], r[1], s.sigma[r[2]] * ys]).filter(r => r[2] > 0), color});
    }
    tables.push(table);
    const mark = el("i", {class: s.line === false ? "dot" : s.dash ? "dashed" : "", style: s.line === false ? `background:${color}` : `border-color:${color}`});
    if (s.legend !== false) legend.append(el("span", {}, mark, s.name + (lo && hi && s.band !== false ? " ± 1σ" : "")));
    options[base].shown = s;
  });
  if (!tables.length) { box.append(el("p", {class: "note"}, "no data")); return; }

  const decorate = u => {
    const ctx = u.ctx, ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath(); ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height); ctx.clip();
    ctx.font = `${11 * ratio}px system-ui, sans-serif`;
    ctx.textAlign = "left"; ctx.textBaseline = "alphabetic";
    for (const m of spec.marks || []) {
      const a = u.valToPos(m.from * xs, "x", true), b = u.valToPos(m.to * xs, "x", true);
      ctx.fillStyle = withAlpha(css("--c5"), .16);
      ctx.fillRect(a, u.bbox.top, b - a, u.bbox.height);
      ctx.fillStyle = css("--soft");
      ctx.fillText(m.label, Math.max(a, u.bbox.left) + 6 * ratio, u.bbox.top + 15 * ratio);
    }
    for (const h of spec.hlines || []) {
      const y = u.valToPos(h.at * ys, "y", true);
      ctx.strokeStyle = css("--faint"); ctx.setLineDash([4 * ratio, 4 * ratio]); ctx.lineWidth = ratio;
      ctx.beginPath(); ctx.moveTo(u.bbox.left, y); ctx.lineTo(u.bbox.left + u.bbox.width, y); ctx.stroke();
      ctx.setLineDash([]); ctx.fillStyle = css("--soft");
      ctx.fillText(h.label, u.bbox.left + 6 * ratio, y - 5 * ratio);
    }
    for (const b of bars) {
      ctx.strokeStyle = b.color; ctx.lineWidth = 1.5 * ratio;
      for (const [x, y, s] of b.rows) {
        const px = u.valToPos(x, "x", true), low = spec.y.log && y - s <= 0 ? y / 3 : y - s;
        const top = u.valToPos(y + s, "y", true), bottom = u.valToPos(low, "y", true), w = 4 * ratio;
        ctx.beginPath(); ctx.moveTo(px, top); ctx.lineTo(px, bottom);
        ctx.moveTo(px - w, top); ctx.lineTo(px + w, top); ctx.moveTo(px - w, bottom); ctx.lineTo(px + w, bottom); ctx.stroke();
      }
    }
    ctx.restore();
  };

  const axis = side => ({stroke: css("--soft"), grid: {stroke: css("--grid"), width: 1}, ticks: {stroke: css("--line"), width: 1, size: 5},
    font: "11.5px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelSize: side === "x" ? 22 : 20,
    size: side === "x" ? 34 : 52, label: spec[side].label, values: (u, v) => v.map(t => t === null ? "" : tick(t)),
    ...(spec[side].log ? {filter: (u, splits) => splits.map(v => v > 0 && Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-6 ? v : null)} : {})});
  const scale = side => ({time: false, distr: spec[side].log ? 3 : 1,
    ...(spec[side].range ? {range: (u, lo, hi) => spec[side].range(lo, hi)} : {})});
  const data = uPlot.join(tables);
  const plot = new uPlot({
    width: Math.max(280, box.clientWidth || 470), height: spec.height || 290, legend: {show: false}, scales: {x: scale("x"), y: scale("y")},
    axes: [axis("x"), axis("y")], series: options, bands, cursor: {points: {size: 6}, y: false},
    hooks: {draw: [decorate], setCursor: [u => {
      if (u.cursor.idx === null || u.cursor.idx === undefined) { readout.textContent = " "; return; }
      const parts = [`${spec.x.label}: ${tick(Number(u.data[0][u.cursor.idx].toPrecision(4)))}`];
      options.forEach((o, k) => { const v = o.shown && u.data[k][u.cursor.idx]; if (isNumber(v)) parts.push(`${o.label}: ${scientific(v)}`); });
      readout.textContent = parts.join("   ·   ");
    }]}}, data, box);
  addEventListener("resize", () => plot.setSize({width: Math.max(280, box.clientWidth), height: spec.height || 290}));
  drawn.push({title: spec.title, canvas: () => box.querySelector("canvas")});
}

// rows: [{label, value, lo, hi, ours, soft}] on a logarithmic axis
function forestPlot(parent, {title, note, unit, rows, failed}) {
  const card = el("div", {class: "card chart"}, failedBadge(failed), el("h3", {}, title));
  if (note) card.append(el("p", {class: "note"}, note));
  const width = 1060, label = 400, right = 150, row = 27, top = 10, height = top + rows.length * row + 46;
  const all = rows.flatMap(r => [r.lo, r.value, r.hi]).filter(v => v > 0).map(Math.log10);
  const from = Math.min(...all) - .12, to = Math.max(...all) + .12;
  const px = v => label + (Math.log10(v) - from) / (to - from) * (width - label - right);
  let svg = "";
  for (let d = Math.ceil(from); d <= to; ++d) {
    svg += `<line x1="${px(10 ** d)}" x2="${px(10 ** d)}" y1="${top}" y2="${height - 40}" stroke="var(--line)"/>` +
           `<text class="soft" x="${px(10 ** d)}" y="${height - 22}" text-anchor="middle">10${superscript(d)}</text>`;
  }
  for (let d = Math.floor(from); d <= to; ++d) for (let k = 2; k < 10; ++k) {
    const v = k * 10 ** d, at = Math.log10(v);
    if (at <= from || at >= to) continue;
    svg += `<line x1="${px(v)}" x2="${px(v)}" y1="${height - 45}" y2="${height - 40}" stroke="var(--faint)"/>`;
    if (to - from < 1.2 && (k === 2 || k === 5)) svg += `<text class="soft" x="${px(v)}" y="${height - 22}" text-anchor="middle">${scientific(v, 1)}</text>`;
  }
  const escape = s => String(s).replace(/&/g, "&amp;").replace(/</g, "&lt;");
  svg += `<text class="soft" x="${(label + width - right) / 2}" y="${height - 4}" text-anchor="middle">${escape(unit)}</text>`;
  rows.forEach((r, i) => {
    const y = top + i * row + row / 2, color = r.ours ? "var(--accent)" : "var(--c0)", fade = r.soft ? .45 : 1;
    if (r.ours) svg += `<rect x="0" y="${y - row / 2}" width="${width}" height="${row}" fill="var(--accent)" opacity=".07"/>`;
    svg += `<text x="8" y="${y + 4}" ${r.ours ? 'font-weight="700"' : ""} opacity="${r.soft ? .65 : 1}">${escape(r.label.length > 62 ? r.label.slice(0, 60) + "…" : r.label)}</text>`;
    if (r.lo > 0 && r.hi > 0) svg += `<line x1="${px(r.lo)}" x2="${px(r.hi)}" y1="${y}" y2="${y}" stroke="${color}" stroke-width="2.5" opacity="${fade}"/>`;
    svg += r.ours ? `<rect x="${px(r.value) - 5}" y="${y - 5}" width="10" height="10" transform="rotate(45 ${px(r.value)} ${y})" fill="${color}"/>`
                  : `<circle cx="${px(r.value)}" cy="${y}" r="4.5" fill="${color}" opacity="${fade}"/>`;
    svg += `<text class="soft" x="${width - 8}" y="${y + 4}" text-anchor="end">${scientific(r.value)}</text>`;
  });
  const box = el("div", {class: "scroll", html: `<svg viewBox="0 0 ${width} ${height}" style="width:100%;min-width:720px" role="img">${svg}</svg>`});
  card.append(box);
  parent.append(card);
  drawn.push({title, svg: () => box.querySelector("svg")});
}

// c[t][y] as colours: time to the right, height upwards
function heatMap(parent, {title, note, time, y, c, xlabel, ylabel, yscale}) {
  const card = el("div", {class: "card chart"}, el("h3", {}, title));
  if (note) card.append(el("p", {class: "note"}, note));
  const canvas = el("canvas"), width = 520, height = 300, left = 52, bottom = 44, rightside = 74, ratio = window.devicePixelRatio || 1;
  canvas.width = width * ratio; canvas.height = height * ratio; canvas.style.width = "100%"; canvas.style.maxWidth = width + "px";
  card.append(canvas); parent.append(card);
  const ctx = canvas.getContext("2d"); ctx.scale(ratio, ratio);
  const w = width - left - rightside, h = height - bottom - 8, most = Math.max(...c.flat().filter(isNumber), 1e-12);
  const color = v => { const t = Math.max(0, Math.min(1, v / most)); // dark blue -> teal -> yellow, perceptually ordered
    const stops = [[38, 20, 72], [44, 62, 140], [26, 122, 142], [62, 175, 118], [180, 210, 62], [253, 231, 80]];
    const p = t * 5, i = Math.min(4, Math.floor(p)), f = p - i;
    return `rgb(${[0, 1, 2].map(k => Math.round(stops[i][k] * (1 - f) + stops[i + 1][k] * f)).join(",")})`; };
  // Each column reaches half-way to its neighbours: the axis is linear in time whatever the output times.
  const last = time[time.length - 1], yh = h / y.length, px = t => left + w * t / last;
  const edge = k => k === 0 ? 0 : k === time.length ? last : (time[k - 1] + time[k]) / 2;
  for (let t = 0; t < time.length; ++t) for (let k = 0; k < y.length; ++k) {
    ctx.fillStyle = color(c[t][k]);
    ctx.fillRect(px(edge(t)), 8 + h - (k + 1) * yh, px(edge(t + 1)) - px(edge(t)) + .6, yh + .6);
  }
  ctx.fillStyle = css("--soft"); ctx.font = "11.5px system-ui, sans-serif"; ctx.textAlign = "center";
  for (let k = 0; k <= 5; ++k) ctx.fillText(tick(Number((last * k / 5).toPrecision(3))), px(last * k / 5), 8 + h + 16);
  ctx.fillText(xlabel, left + w / 2, 8 + h + 34);
  ctx.textAlign = "right";
  const yt = y.map(v => v * yscale), span = yt[yt.length - 1] + yt[0];
  for (let k = 0; k <= 4; ++k) ctx.fillText(tick(Number((span * k / 4).toPrecision(3))), left - 6, 8 + h - k * h / 4 + 4);
  ctx.save(); ctx.translate(12, 8 + h / 2); ctx.rotate(-Math.PI / 2); ctx.textAlign = "center"; ctx.fillText(ylabel, 0, 0); ctx.restore();
  for (let k = 0; k < 60; ++k) { ctx.fillStyle = color(most * k / 59); ctx.fillRect(left + w + 14, 8 + h - (k + 1) * h / 60, 14, h / 60 + .6); }
  ctx.fillStyle = css("--soft"); ctx.textAlign = "left";
  ctx.fillText(tick(Number(most.toPrecision(2))), left + w + 32, 16); ctx.fillText("0", left + w + 32, 8 + h);
  drawn.push({title, canvas: () => canvas});
}

// After the charts had time to draw: is there ink on each, and did nothing go wrong on the way?
function selfCheck() {
  const empty = drawn.filter(d => {
    if (d.svg) return !d.svg() || d.svg().children.length < 3;
    const canvas = d.canvas();
    if (!canvas || !canvas.width) return true;
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let ink = 0;
    for (let i = 3; i < pixels.length; i += 4) if (pixels[i]) ++ink;
    return ink < canvas.width;
  }).map(d => d.title);
  const node = document.getElementById("selfcheck");
  node.dataset.charts = drawn.length;
  node.dataset.empty = empty.join("; ");
  node.dataset.errors = window.pageErrors.join("; ");
  node.dataset.verdict = empty.length || window.pageErrors.length || !drawn.length ? "broken" : "all charts drawn";
}
