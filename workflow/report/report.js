"use strict";
// The report, section by section. All numbers come from the JSON in the page (results.json, SI units in the keys).
const results = JSON.parse(document.getElementById("results").textContent);
const page = document.getElementById("report");
const points = results.points || [];
const many = points.length > 1;
const kinds = [...new Set(points.flatMap(p => Object.keys(p.calibrations || {})))].sort((a, b) => (b === "platelet") - (a === "platelet"));
let kind = kinds[0];
const um = 1e6, ms = 1e3, umSquared = 1e12;  // m -> um, s -> ms, m2 -> um2

const calibrationOf = (p, k = kind) => (p.calibrations || {})[k];
const failed = c => c && c.gate && c.gate.passed === false;
const anyFailed = () => { const bad = points.filter(p => failed(calibrationOf(p))); return bad.length ? (many ? bad.map(p => p.label).join(", ") : "these trajectories") : ""; };
const kindName = k => ({platelet: "platelets", rbc: "red blood cells"})[k] || k;
const section = title => { const s = el("section", {}, el("h2", {}, title)); page.append(s); return s; };
const seconds = s => !isNumber(s) ? "–" : s < .9995 ? (s * 1e3).toFixed(0) + " ms" : s < 120 ? Number(s.toPrecision(3)) + " s" :
  s < 7200 ? (s / 60).toFixed(1) + " min" : (s / 3600).toFixed(1) + " h";

// One value with its error, in powers of ten that fit: "1.25 ± 0.05 × 10⁻¹⁰ m²/s"
function withError(value, sigma, unit) {
  if (!isNumber(value)) return "–";
  const power = value ? Math.floor(Math.log10(Math.abs(value))) : 0, scale = 10 ** power;
  return `${digits(value / scale, sigma / scale)} ± ${digits(sigma / scale, sigma / scale)} × 10${superscript(power)} ${unit}`;
}

// Synthetic trajectories: the true D averaged over the layer in which the analysed displacements start.
function againstTruth(p) {
  const core = (calibrationOf(p) || {}).core, {y_m: y, D_m2_per_s: D} = p.truth;
  if (!core || !core.y_range_m || !isNumber(core.y_range_m[0])) return "";
  const inside = D.filter((_, k) => y[k] >= core.y_range_m[0] && y[k] <= core.y_range_m[1]), mean = inside.reduce((a, b) => a + b, 0) / inside.length;
  return `the trajectories were generated with D = ${scientific(mean)} m²/s in this layer; found ${withError(core.D_m2_per_s, core.D_sigma, "m²/s")}, ` +
         `${Math.abs((core.D_m2_per_s - mean) / core.D_sigma).toFixed(1)} standard errors away.`;
}

// Which sources measured under matching conditions agree within two standard errors, and which do not.
function againstLiterature(p) {
  const verdicts = (calibrationOf(p) || {}).verdict || [], matched = verdicts.filter(v => v.matched_conditions);
  if (!verdicts.length) return "";
  if (!matched.length) return "no published value was measured under these conditions; those that come near stand in the chart below.";
  const named = v => v.source.replace(/_/g, " "), times = v => Number((calibrationOf(p).core.D_m2_per_s / v.D_m2_per_s).toPrecision(2)) + " times theirs";
  const parts = [["within two standard errors of ", v => isNumber(v.z) && Math.abs(v.z) < 2, v => `${named(v)} (${Math.abs(v.z).toFixed(1)})`],
                 ["not within two of ", v => isNumber(v.z) && Math.abs(v.z) >= 2, v => `${named(v)} (${Math.abs(v.z).toFixed(1)} standard errors, ours is ${times(v)})`],
                 ["no error is known for ", v => !isNumber(v.z), v => `${named(v)} (ours is ${times(v)})`]]
    .map(([words, test, text]) => matched.filter(test).length ? words + matched.filter(test).map(text).join(", ") : "").filter(t => t);
  return "of the sources under matching conditions, D is " + parts.join("; ") + "." + (failed(calibrationOf(p)) ? " The artefact gate failed: agreement proves nothing." : "");
}

function headline() {
  page.append(el("div", {class: "brand"}, "hemowalk"), el("h1", {}, results.title || results.name || "Campaign"));
  page.append(el("p", {class: "lead"}, results.summary || "From trajectories of blood cells to their diffusion coefficient, and from there to transport at the scale of a device."));
  // One banner per point; kinds whose findings are the same (they share the flow) share the lines.
  for (const p of points) {
    const bad = kinds.filter(k => failed(calibrationOf(p, k)));
    if (!bad.length) continue;
    const lines = bad.flatMap(k => calibrationOf(p, k).gate.findings.filter(f => f.passed === false).map(f =>
      ({k, text: `${f.name.replace(/_/g, " ")}: ${scientific(f.value)} (limit ${scientific(f.limit)})${f.note ? ". " + f.note : ""}`})));
    page.append(el("div", {class: "banner bad"}, el("strong", {}, "Artefact gate failed" + (many ? `: ${p.label}. ` : ". ")),
      "The numbers below are given, but the trajectories carry something that is not diffusion.",
      el("ul", {}, [...new Set(lines.map(l => l.text))].map(text => {
        const of = lines.filter(l => l.text === text).map(l => kindName(l.k));
        return el("li", {}, (of.length === kinds.length ? "" : of.join(", ") + ": ") + text);
      }))));
  }
  const heads = el("div", {class: "heads"});
  for (const k of kinds) for (const p of points) {
    const c = calibrationOf(p, k), core = c && c.core;
    if (!core || !isNumber(core.D_m2_per_s)) continue;
    const power = Math.floor(Math.log10(Math.abs(core.D_m2_per_s) || 1)), scale = 10 ** power;
    const value = el("div", {class: "value"}, digits(core.D_m2_per_s / scale, core.D_sigma / scale),
      el("small", {}, ` ± ${digits(core.D_sigma / scale, core.D_sigma / scale)} × 10${superscript(power)} m²/s`));
    const relative = core.D_sigma / core.D_m2_per_s;
    heads.append(el("div", {class: "card head"}, el("div", {class: "of"}, `D of ${kindName(k)}, wall-normal${many ? " · " + p.label : ""}`), value,
      el("div", {class: "ci"}, `${scientific(core.D_m2_per_s * umSquared)} µm²/s · ${core.y_range_m && isNumber(core.y_range_m[0]) ? `start at y = ${digits(core.y_range_m[0] * um)}–${digits(core.y_range_m[1] * um)} µm, ${core.lag_s > 0 ? `lag ${digits(core.lag_s * ms)} ms` : `estimator: ${((c.law || {}).core_estimator || "core").replace(/_/g, " ")}`}` : "core"} · ${c.n_platelets} ${kindName(k)}` +
        (p.runs && p.runs.length > 1 ? ` in ${p.runs.length} independent runs` : "") +
        (relative > .3 ? ` · wide: ±${Math.round(relative * 100)} %, too few cells or too short a run for more` : ""))));
  }
  page.append(heads);
  if (results.truth) page.append(el("div", {class: "banner ok"}, results.truth));
  for (const p of points) {
    const text = p.truth ? againstTruth(p) : againstLiterature(p);
    if (text) page.append(el("p", {class: "verdict"}, many ? el("strong", {}, p.label + ": ") : null, text));
  }
  page.append(el("p", {class: "note", style: "color:var(--soft);font-size:13px"},
    "D measures the wall-normal spreading in the red-cell-rich layer at the stated shear rate and hematocrit. Interior viscosity contrast is not modelled; " +
    "the damping parameter κ stands in for it."));
}

function conditions() {
  const s = section(many ? "What was analysed, point by point" : "What was analysed");
  const rows = [["source", p => p.source && p.source.text], ["box", p => p.conditions && p.conditions.box_m && p.conditions.box_m.map(v => Number((v * um).toPrecision(4))).join(" × ") + " µm"],
    ["gap between walls", p => p.conditions && isNumber(p.conditions.gap_m) && scientific(p.conditions.gap_m * um) + " µm"],
    ["shear rate", p => p.conditions && isNumber(p.conditions.shear_rate_1_per_s) && scientific(p.conditions.shear_rate_1_per_s) + " 1/s"],
    ["hematocrit (measured)", p => p.conditions && isNumber(p.conditions.hematocrit) && p.conditions.hematocrit > 0 && (100 * p.conditions.hematocrit).toFixed(1) + " %"],
    ["κ damping", p => p.conditions && isNumber(p.conditions.kappa_damping) && p.conditions.kappa_damping],
    ["shape-recovery time", p => p.conditions && isNumber(p.conditions.t_c_s) && scientific(p.conditions.t_c_s * ms) + " ms"],
    ["capillary number", p => p.conditions && isNumber(p.conditions.Ca) && scientific(p.conditions.Ca)],
    ["Reynolds number", p => p.conditions && isNumber(p.conditions.Re) && scientific(p.conditions.Re)],
    ["acceleration s", p => p.conditions && p.conditions.acceleration],
    ["cells", p => p.cells && Object.entries(p.cells).map(([k, n]) => `${n} ${kindName(k)}`).join(", ")],
    ["record per run", p => p.record && isNumber(p.record.duration_s) && seconds(p.record.duration_s) + `, analysed from ${seconds(p.record.t0_s)}`],
    ["independent runs", p => p.runs && p.runs.length],
    ["cell-free layer", p => calibrationOf(p) && isNumber(calibrationOf(p).cell_free_layer_m) && calibrationOf(p).cell_free_layer_m > 0 && scientific(calibrationOf(p).cell_free_layer_m * um) + " µm"]];
  const shown = rows.filter(([, f]) => points.some(p => f(p)));
  s.append(el("div", {class: "card scroll"}, el("table", {},
    many ? el("tr", {}, el("th"), points.map(p => el("th", {}, p.label))) : null,
    shown.map(([name, f]) => el("tr", {}, el("th", {}, name), points.map(p => el("td", {}, String(f(p) || "–"))))))));
}

function kindTabs(s) {
  if (kinds.length < 2) return;
  s.append(el("div", {class: "tabs"}, kinds.map(k => {
    const b = el("button", {class: k === kind ? "on" : ""}, kindName(k));
    b.onclick = () => { kind = k; draw(); document.getElementById("diffusion").scrollIntoView(); };
    return b;
  })));
}

const curve = (c, method, layer) => (c && c.msd || []).find(m => m.method === method && m.layer === layer);

function msdCharts() {
  const s = section("From displacements to D");
  s.id = "diffusion";
  kindTabs(s);
  const grid = el("div", {class: "grid"}); s.append(grid);
  const charts = [["single_origin", "all", "MSD from one origin, all " + kindName(kind)], ["single_origin", "core", "MSD from one origin, core layer"],
                  ["time_averaged", "all", "Time-averaged MSD, all " + kindName(kind)], ["time_averaged", "core", "Time-averaged MSD, core layer"]];
  for (const [method, layer, title] of charts) {
    const series = [], log = method === "time_averaged";
    points.forEach((p, i) => {
      const m = curve(calibrationOf(p), method, layer);
      if (!m) return;
      series.push({name: many ? p.label : "measured", x: m.lag_s, y: m.msd_m2, sigma: m.sigma_m2, color: palette(i)});
      const fit = m.fit || {};
      if (isNumber(fit.slope_m2_per_s) && fit.slope_m2_per_s > 0) {
        const [a, b] = fit.range_s, n = 40, x = Array.from({length: n}, (_, k) => a + (b - a) * k / (n - 1));
        series.push({name: `fit: D = ${scientific(fit.slope_m2_per_s / 2)} m²/s`, x, y: x.map(t => fit.intercept_m2 + fit.slope_m2_per_s * t),
                     color: many ? palette(i) : css("--accent"), dash: [7, 5], width: 2});
      }
    });
    if (series.length) lineChart(grid, {title, failed: anyFailed(), note: log ? "All origins after the transient; slope 1 is diffusion." : "The estimator of the paper: a straight line through the ensemble.",
      x: {label: "lag (ms)", scale: ms, log}, y: {label: "MSD (µm²)", scale: umSquared, log}, series});
  }
  const records = points.map((p, i) => [p, i]).filter(([p]) => p.record && p.record.time_s);
  if (records.length) {
    const t0 = Math.max(...records.map(([p]) => p.record.t0_s || 0)), start = Math.min(...records.map(([p]) => p.record.time_s[0]));
    lineChart(grid, {title: "The whole record", note: "Mean square wall-normal displacement since the first sample. The shaded transient is left out of every estimate.",
      x: {label: "time (ms)", scale: ms}, y: {label: "⟨(y − y₀)²⟩ (µm²)", scale: umSquared},
      marks: t0 > start ? [{from: start, to: t0, label: "transient"}] : [],
      series: records.map(([p, i]) => ({name: many ? p.label : "platelets", x: p.record.time_s, y: p.record.msd_m2, color: palette(i)}))});
  }
  const kurtosis = points.map((p, i) => [p, i, calibrationOf(p)]).filter(([, , c]) => c && c.kurtosis && (c.kurtosis.lag_s || []).length);
  if (kurtosis.length) lineChart(grid, {title: "Are the steps Gaussian?", note: "Excess kurtosis of displacements: 0 is Gaussian; heavy tails that fade with the lag do not survive coarse-graining.",
    x: {label: "lag (ms)", scale: ms, log: true}, y: {label: "excess kurtosis"}, hlines: [{at: 0, label: "Gaussian"}], failed: anyFailed(),
    series: kurtosis.map(([p, i, c]) => ({name: many ? p.label : "measured", x: c.kurtosis.lag_s, y: c.kurtosis.excess, points: true, color: palette(i)}))});
  const heldOut = points.map((p, i) => [p, i, (calibrationOf(p) || {}).holdout_walk]).filter(([, , h]) => h && (h.lag_s || []).length);
  if (heldOut.length) lineChart(grid, {title: "Does the coarse walk predict cells it has not seen?", note: "The law from half of the cells walks the other half: mean square displacement observed over predicted. p of the displacements' histogram: "
      + heldOut.map(([p, , h]) => (many ? p.label + " " : "") + h.histogram_p.filter(isNumber).map(v => v.toPrecision(2)).join(", ")).join("; ") + ".",
    x: {label: "lag (ms)", scale: ms, log: true}, y: {label: "observed / predicted", range: () => { const reach = Math.max(0.1, ...heldOut.flatMap(([, , h]) => h.msd_ratio.map((r, k) => Math.abs(r - 1) + h.msd_sigma[k]))); return [1 - 1.1 * reach, 1 + 1.1 * reach]; }}, hlines: [{at: 1, label: "as predicted"}], failed: anyFailed(),
    series: heldOut.map(([p, i, h]) => ({name: many ? p.label : "unseen half", x: h.lag_s, y: h.msd_ratio, sigma: h.msd_sigma, points: true, color: palette(i)}))});
}

function literature() {
  const real = points.filter(p => calibrationOf(p) && !p.truth);  // synthetic trajectories have a truth, no literature
  const rows = [], estimates = {paper: "the paper's estimator", paper_all: "the paper's, all cells", plateau: "plateau", gls: "generalised least squares", green_kubo: "Green-Kubo", confined: "plateau, confinement allowed for", without_jumps: "plateau, jumps removed"};
  points.forEach(p => {
    const c = calibrationOf(p);
    if (!c || p.truth) return;
    const shown = real.length > 1 ? ["paper", (c.law || {}).core_estimator || "plateau"] : Object.keys(c.estimators || {});
    for (const [name, e] of Object.entries(c.estimators || {}))
      if (shown.includes(name) && isNumber(e.D_m2_per_s) && e.D_m2_per_s > 0) {
        const [lo, hi] = e.ci68 && isNumber(e.ci68[0]) ? e.ci68 : [e.D_m2_per_s - e.sigma, e.D_m2_per_s + e.sigma];
        rows.push({label: `this work · ${real.length > 1 ? p.label + " · " : ""}${estimates[name] || name}`, value: e.D_m2_per_s, lo, hi, ours: true});
      }
  });
  const first = real.map(p => calibrationOf(p)).find(c => c && c.verdict && c.verdict.length);
  const published = first ? first.verdict.filter(v => isNumber(v.D_m2_per_s)) : [];
  published.forEach(v => rows.push({label: v.source.replace(/_/g, " ") + (v.matched_conditions ? "" : " (other conditions)"), value: v.D_m2_per_s, lo: v.D_lo, hi: v.D_hi, soft: !v.matched_conditions}));
  if (!rows.length || !real.length) return;
  const s = section("D beside the literature");
  forestPlot(s, {title: `Diffusion coefficient of ${kindName(kind)}`, unit: "D (m²/s)", rows, failed: anyFailed(),
    note: "Diamonds: this campaign with 68 % intervals. Circles: published values with their range where one is given; pale where shear, hematocrit, direction or particle differ."});
  const said = real.flatMap(p => (calibrationOf(p).verdict || []).filter(v => v.statement).map(v => [p, v]));
  if (said.length) s.append(el("details", real.length > 1 ? {} : {open: ""}, el("summary", {}, "In words"), el("ul", {class: "verdicts"},
    said.map(([p, v]) => el("li", {}, (real.length > 1 ? p.label + ": " : "") + v.statement)))));
}

// The laws of all points together: trends only where they exceed their errors, and the claims stated before the data.
function overConditions() {
  const all = results.over_conditions;
  if (!all) return;
  const s = section("Does D depend on the conditions?"), tested = (all.hypotheses || []).filter(h => h.outcome !== "not tested");
  const lines = [...tested.map(h => h.statement + " (stated before the data)"), ...(all.terms || []).map(t => t.statement),
    ...(all.left_out || []).map(t => "left out: " + t), ...(all.warnings || [])];
  s.append(el("div", {class: "card"}, el("ul", {class: "verdicts", style: "margin:0"}, lines.map(t => el("li", {}, t)))));
}

function localLaw() {
  const with_profile = points.map((p, i) => [p, i, (calibrationOf(p) || {}).profile]).filter(([, , q]) => q && (q.y_m || []).length);
  if (!with_profile.length) return;
  const s = section("The local law across the gap"), grid = el("div", {class: "grid"}); s.append(grid);
  const chart = (title, note, label, scale, get, sigma, extra = {}) => {
    const series = with_profile.filter(([, , q]) => (q[get] || []).length).map(([p, i, q]) =>
      ({name: many ? p.label : "measured", x: q.y_m, y: q[get], sigma: q[sigma], color: palette(i), width: 1}));
    with_profile.forEach(([p, i]) => {  // what the walks use: smooth, fitted through the walker's own propagator
      const law = (calibrationOf(p) || {}).law_profile;
      if (law && (law.y_m || []).length && (law[get] || []).length) series.push({name: "thick: the smooth law", legend: series.every(q => q.width !== 3), x: law.y_m, y: law[get], sigma: (law[sigma] || []).length ? law[sigma] : undefined, color: palette(i), width: 3});
    });
    points.forEach((p, i) => { if (get === "D_m2_per_s" && p.truth) series.push({name: "truth", legend: series.every(q => q.name !== "truth"), x: p.truth.y_m, y: p.truth.D_m2_per_s, color: css("--c5"), dash: [6, 5]}); });
    if (series.length) lineChart(grid, {title, note, x: {label: "distance from the lower wall y (µm)", scale: um}, y: {label, scale}, series, failed: anyFailed(), ...extra});
  };
  chart("D(y)", "Thin: Kramers-Moyal at the plateau lag, biased low within about 2 µm of a wall. Thick: the smooth law, fitted through the walker's own propagator.", "D (10⁻¹⁰ m²/s)", 1e10, "D_m2_per_s", "sigma");
  chart("Drift v(y)", "Without the gradient of D: the flux is J = v c − D c′.", "v (µm/s)", um, "v_m_per_s", "v_sigma", {hlines: [{at: 0, label: ""}]});
  chart("Where the cells are", "Density of the analysed cells, all samples after the transient.", "density (1/µm)", 1e-6, "density_1_per_m");
}

function blood() {
  const having = points.map((p, i) => [p, i, p.blood]).filter(([, , b]) => b && (b.y_m || []).length);
  if (!having.length) return;
  const s = section("The flow and the red cells"), grid = el("div", {class: "grid"}); s.append(grid);
  const chart = (title, note, label, scale, get, sigma) => {
    const series = having.filter(([, , b]) => (b[get] || []).length).map(([p, i, b]) => ({name: many ? p.label : "mean after the transient", x: b.y_m, y: b[get], sigma: b[sigma], color: palette(i)}));
    if (get === "velocity_z_m_per_s") { const b = having[0][2]; if (isNumber(b.shear_rate_1_per_s) && b.shear_rate_1_per_s > 0)
      series.push({name: "homogeneous fluid", x: b.walls_y_m, y: b.wall_velocity_m_per_s, color: css("--c5"), dash: [6, 5]}); }
    if (series.length) lineChart(grid, {title, note, x: {label: "y (µm)", scale: um}, y: {label, scale}, series});
  };
  chart("Velocity along the flow", null, "u (mm/s)", 1e3, "velocity_z_m_per_s");
  chart("Hematocrit", null, "hematocrit", 1, "hematocrit");
  chart("Shear stress, fluid and cells", "Uniform across the gap once the flow is steady.", "stress (Pa)", 1, "shear_stress_pa");
  const series = having.filter(([, , b]) => (b.time_s || []).length && (b.mean_stress_pa || []).length);
  if (series.length) lineChart(grid, {title: "Stress against time", note: "Start-up of the suspension: the transient is what the estimates leave out.", x: {label: "time (ms)", scale: ms}, y: {label: "mean stress (Pa)"},
    marks: points[0].record && points[0].record.t0_s > 0 ? [{from: 0, to: points[0].record.t0_s, label: "transient"}] : [],
    series: series.map(([p, i, b]) => ({name: many ? p.label : "mean over the gap", x: b.time_s, y: b.mean_stress_pa, color: palette(i)}))});
}

function coarse() {
  const cases = results.coarse || [];
  if (!cases.length) return;
  const s = section("At the scale of the device");
  const names = [...new Set(cases.map(c => c.name))];
  for (const name of names) {
    const group = cases.filter(c => c.name === name), grid = el("div", {class: "grid", style: "margin-bottom:16px"}), one = group[0];
    s.append(el("h3", {style: "margin:6px 0 8px"}, name.replace(/_/g, " ") + (one.case ? ` — layer of ${scientific(one.case.height_m * 1e3)} mm, bottom: ${one.case.bottom}, top: ${one.case.top}, ${scientific(one.walkers)} walkers` : "")), grid);
    const series = [];
    group.forEach((c, i) => {
      const who = group.length > 1 ? c.point + ": " : "";
      const total = c.absorbed_sigma.map((v, k) => Math.hypot(v || 0, (c.absorbed_law_sigma || [])[k] || 0));
      series.push({name: who + "walkers", x: c.time_s, y: c.absorbed_fraction, sigma: total, points: true, line: false, color: palette(i)});
      if (c.exact) series.push({name: `exact, D = ${scientific(c.exact.D_m2_per_s)}`, x: c.exact.time_s, y: c.exact.absorbed_fraction, color: palette(i), dash: c.exact.same_problem ? undefined : [6, 5]});
    });
    if (one.absorbed_fraction.some(v => v > 0)) lineChart(grid, {title: "Absorbed fraction", note: "Bars: sampling of the walkers and uncertainty of the law together. " + (group.every(c => !c.exact || c.exact.same_problem) ? "Line: the exact series." : "Dashed: the exact series for one constant D, that of the core, for comparison."), x: {label: "time (s)"}, y: {label: "absorbed fraction", range: (lo, hi) => [0, Math.min(1, hi * 1.12)]}, series, failed: anyFailed()});
    const {y_m: y, c} = one.profile || {};
    if (y && c && c.length) {
      const rows = c;
      if (one.time_s.length >= 12) heatMap(grid, {title: "Concentration", note: "Relative to all walkers spread over the slab" + (group.length > 1 ? "; " + one.point : "") + ".", time: one.time_s, y, c: rows, xlabel: "time (s)", ylabel: "y (mm)", yscale: 1e3});
      else lineChart(grid, {title: "Concentration profiles", note: "Relative to all walkers spread over the slab" + (group.length > 1 ? "; " + one.point : "") + ".", x: {label: "y (mm)", scale: 1e3}, y: {label: "c / c₀", range: (lo, hi) => [0, hi * 1.08]},
        series: one.time_s.map((t, k) => ({name: `t = ${scientific(t)} s`, x: y, y: rows[k], color: palette(k)}))});
    }
    s.append(el("p", {class: "note", style: "color:var(--soft);font-size:13px"}, group.map(c => `${c.method === "walk" ? "Random walk" : "Fokker-Planck"}: ${c.reason}`)[0] || ""));
  }
}

function diagnostics() {
  const having = points.map((p, i) => [p, i, p.diagnostics]).filter(([, , d]) => d && (d.time_s || []).length);
  if (!having.length) return;
  const s = section("Can the solver be trusted?"), grid = el("div", {class: "grid"}); s.append(grid);
  const chart = (title, note, key, label, log) => {
    const series = having.filter(([, , d]) => (d[key] || []).some(v => isNumber(v))).map(([p, i, d]) => ({name: many ? p.label : "run", x: d.time_s, y: d[key], color: palette(i), width: 1.5}));
    if (series.length) lineChart(grid, {title, note, x: {label: "time (ms)", scale: ms}, y: {label, log}, series, height: 230});
  };
  chart("Momentum residual", "Fluid, cells and walls together, relative.", "momentum_residual", "relative", true);
  chart("Energy residual", "Power of the walls that no term of the budget accounts for, relative.", "energy_residual", "relative", false);
  chart("Largest volume error of a cell", null, "volume_error_max", "relative", false);
  chart("Mass error", null, "mass_error", "relative", false);
  chart("Largest speed over wall speed", null, "max_speed_ratio", "ratio", false);
  chart("Largest overlap", null, "overlap_max", "overlap (m)", false);
  chart("Slip at the membranes", null, "slip_rms", "relative", false);
}

function runs() {
  const rows = results.runs || [];
  if (!rows.length) return;
  const s = section("Runs");
  s.append(el("div", {class: "card scroll"}, el("table", {}, el("tr", {}, ["run", "point", "seed", "state", "attempt", "wall time", "reason"].map(h => el("th", {}, h))),
    rows.map(r => el("tr", {}, el("td", {}, el("code", {}, r.hash)), el("td", {}, r.point || "–"), el("td", {}, String(r.seed ?? "–")),
      el("td", {}, el("span", {class: "state " + r.state}, r.state.replace("_", " "))), el("td", {}, String(r.attempt ?? "–")), el("td", {}, seconds(r.wall_s)), el("td", {}, r.reason || ""))))));
}

function warnings() {
  const all = [...new Set([...(results.warnings || []), ...points.flatMap(p => (p.warnings || []).map(w => (many ? p.label + ": " : "") + w)), ...points.flatMap(p => Object.entries(p.calibrations || {}).flatMap(([k, c]) => (c.warnings || []).map(w => `${many ? p.label + ", " : ""}${kindName(k)}: ${w}`))),
    ...(results.coarse || []).flatMap(c => (c.warnings || []).map(w => `${c.name}: ${w}`))])];
  if (!all.length) return;
  section("Read this before quoting a number").append(el("div", {class: "card"}, el("ul", {class: "verdicts", style: "margin:0"}, all.map(w => el("li", {}, w)))));
}

function reproduce() {
  const s = section("How to reproduce it"), card = el("div", {class: "card"}); s.append(card);
  if (results.command) card.append(el("pre", {}, results.command));
  const facts = [["hemowalk", results.version], ["input sha256", results.input_sha256], ["seed", results.seed], ["written", results.written], ["machine", results.machine && `${results.machine.threads} threads`],
    ["program", results.program], ["wall time", results.wall_s && seconds(results.wall_s)]].filter(([, v]) => v !== undefined && v !== null && v !== "");
  card.append(el("table", {}, facts.map(([k, v]) => el("tr", {}, el("th", {}, k), el("td", {}, el("code", {}, String(v)))))));
  if (results.campaign_yaml) card.append(el("details", {}, el("summary", {}, "campaign, as it was understood"), el("pre", {}, results.campaign_yaml)));
  const laws = points.filter(p => p.law_yaml);
  for (const p of laws) card.append(el("details", {}, el("summary", {}, "transport law" + (many ? ", " + p.label : "")), el("pre", {}, p.law_yaml)));
  page.append(el("footer", {}, "Charts: uPlot (MIT licence). All data are in this page's source."));
}

function draw() {
  page.textContent = "";
  drawn.length = 0;
  document.title = (results.title || results.name || "campaign") + " · hemowalk";
  for (const part of [headline, conditions, msdCharts, literature, overConditions, localLaw, blood, coarse, diagnostics, runs, warnings, reproduce]) {
    try { part(); }
    catch (error) {  // one section that fails must not take the others with it, but it is said and counted
      window.pageErrors.push(part.name + ": " + error.message);
      page.append(el("div", {class: "banner bad"}, `This section could not be drawn (${part.name}: ${error.message}).`));
    }
  }
}
draw();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
setTimeout(selfCheck, 400);
