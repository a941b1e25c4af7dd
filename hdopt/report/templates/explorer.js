"use strict";
// The explorer: what the sliders say becomes a drive, its closed form is computed and drawn once a frame; what takes
// longer, the path of one input and the cloud of a changed design, is computed in slices between frames.
(() => {
  const F = globalThis.HdoptClosedForm, C = globalThis.HdoptCharts;
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("explorer-data").textContent);
  const { gear, parameters, choices, requirement, cloud, orders } = data;
  const canvas = (name) => document.querySelector(`.${name} canvas`);
  const PLACES = 360, PATH_POINTS = 41, SLICE_MS = 7, QUARTER = 91;
  const BINS = 40;
  const byKey = new Map([...parameters, ...choices].map((one) => [one.key, one]));
  const errorKeys = parameters.filter((one) => one.section === "errors").map((one) => one.key);
  const scales = { sequential: C.colourOf(data.sequential) };

  const atStudy = () => Object.fromEntries([...parameters, ...choices].map((one) => [one.key, one.value]));
  let values = atStudy(), reference = null, turn = 0, against = "axis_eccentricity_mm";

  // ---- from values to numbers ---------------------------------------------------------------------------------------

  const inside = (key, value) => (key.endsWith("_deg") ? (value * Math.PI) / 180 : value);
  const designOf = (from) => ({
    pressureAngle: inside("_deg", from.pressure_angle_deg), width: from.width_mm, wrapAngle: inside("_deg", from.wrap_angle_deg),
    profile: from.profile, structure: from.structure,
  });
  const driveOf = (from) => F.drive(gear, designOf(from), errorKeys.map((key) => inside(key, from[key])));
  const designKey = (from) => JSON.stringify(designOf({ ...from, wrap_angle_deg: from.profile === "two_disk" ? from.wrap_angle_deg : 0 }));

  let rigid = { key: "" };
  // Contact and bending depend on the profile alone.
  const ringOf = (drive, from) => {
    const key = `${from.profile} ${from.profile === "two_disk" ? from.wrap_angle_deg : ""}`;
    if (rigid.key === key) return rigid;
    const angles = Array.from({ length: QUARTER }, (_, i) => ((Math.PI / 2) * i) / (QUARTER - 1));
    const contact = F.contact(gear, drive.profile), bending = F.bending(gear, drive.profile);
    const overlap = gear.fsAddendum === null || gear.csAddendum === null ? null : angles.map((phi) => F.tipOverlap(gear, drive.profile, phi));
    const perChange = gear.modulus === null ? 1000 : (gear.modulus * gear.wall) / 2;
    const bent = gear.wall === null ? null : angles.map((phi) => Math.abs(perChange * F.curvatureChange(gear, drive.profile, phi)));
    return (rigid = { key, contact, bending, overlap, bent });
  };

  let amplitudesOf = null;
  const evaluate = (from, carpet) => {
    const drive = driveOf(from), ring = ringOf(drive, from);
    const [low, high] = F.extremes(drive);
    const carpetValues = F.carpet(drive, PLACES, carpet && carpet.length === drive.phases * PLACES ? carpet : undefined);
    amplitudesOf ??= F.amplitudesAt(drive.phases, PLACES, orders.map((one) => one.order));
    const amplitudes = amplitudesOf(carpetValues);
    const k = ring.contact.homogenization;
    const peakToPeak = high - low, evened = k === undefined ? null : k * peakToPeak;
    return { phases: drive.phases, low, high, peakToPeak, evened, carpet: carpetValues, amplitudes, ring };
  };

  const judged = (found) => (requirement && requirement.evened ? found.evened ?? found.peakToPeak : found.peakToPeak);

  // ---- what takes longer than a frame: done in slices, given up when it is no longer wanted --------------------------

  const job = () => {
    let id = 0;
    return (step, whenDone) => {
      const own = ++id;
      const slice = () => {
        if (own !== id) return;
        const end = performance.now() + SLICE_MS;
        let more = true;
        while (more && performance.now() < end) more = step();
        if (more) setTimeout(slice, 12);
        if (whenDone) whenDone(!more);
      };
      setTimeout(slice, 0);
    };
  };

  // What the requirement speaks of: the peak-to-peak of one tooth pair, or evened out by the teeth in contact.
  const judgedPeak = (drive) => {
    const k = requirement && requirement.evened ? F.contact(gear, drive.profile).homogenization : 1;
    return (k ?? 1) * F.peakToPeak(drive);
  };

  let path = { key: "", x: [], y: [] }, pathWanted = "";
  const pathJob = job();
  const pathKey = () => `${against} ${JSON.stringify({ ...values, [against]: 0 })}`;
  const wantPath = () => {
    const one = byKey.get(against), key = pathKey(), from = { ...values };
    if (pathWanted === key) return;
    pathWanted = key;
    if (path.against !== one.key) path = { key: "", x: [], y: [] };
    const made = { key, against: one.key, x: [], y: [] };
    pathJob(() => {
      const x = one.low + ((one.high - one.low) * made.x.length) / (PATH_POINTS - 1);
      made.x.push(x);
      made.y.push(judgedPeak(driveOf({ ...from, [one.key]: x })));
      return made.x.length < PATH_POINTS;
    }, (done) => { if (done) { path = made; drawSpread(); } });
  };

  const spread = cloud && { key: designKey(atStudy()), y: Float64Array.from(cloud.peak_to_peak), known: cloud.peak_to_peak.length };
  const rows = cloud && cloud.errors.map((row) => row.map((value, i) => inside(errorKeys[i], value)));
  const columns = cloud && errorKeys.map((_, i) => Float64Array.from(cloud.errors, (row) => row[i]));
  const cloudJob = job();
  const wantCloud = () => {
    if (!cloud || spread.key === designKey(values)) return;
    spread.key = designKey(values);
    if (spread.key === designKey(atStudy())) {
      spread.y.set(cloud.peak_to_peak); spread.known = rows.length;
      cloudJob(() => false);
      return;
    }
    const design = designOf(values);
    spread.known = 0;
    cloudJob(() => {
      spread.y[spread.known] = judgedPeak(F.drive(gear, design, rows[spread.known]));
      return ++spread.known < rows.length;
    }, () => drawSpread());
  };

  // ---- drawing ------------------------------------------------------------------------------------------------------

  const nice = (value) => {
    const power = 10 ** Math.floor(Math.log10(value || 1));
    return power * [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((factor) => factor * power >= value);
  };
  // An axis that grows at once and shrinks only when less than half of it is used: it does not jitter under a slider.
  const held = {};
  const axisTop = (name, wanted) => {
    const now = held[name];
    if (now === undefined || wanted > now || wanted < 0.45 * now) held[name] = nice(wanted * 1.08);
    return held[name];
  };
  const axisRange = (low, high) => {
    const now = held.range;
    if (now && low >= now[0] && high <= now[1] && high - low > 0.45 * (now[1] - now[0])) return now;
    const step = nice((high - low || 0.1) / 8);
    return (held.range = [Math.floor((low - 0.3 * step) / step) * step, Math.ceil((high + 0.3 * step) / step) * step]);
  };

  let found = null, waiting = false, drawn = 0;
  const times = [];

  const draw = () => {
    waiting = false;
    const start = performance.now();
    found = evaluate(values, found && found.carpet);
    turn = Math.min(turn, found.phases - 1);
    const value = judged(found), met = requirement ? value <= requirement.limit : null;
    const factor = value / found.peakToPeak || 1;
    const limit = requirement ? requirement.limit / factor : null;
    const scale = axisRange(Math.min(found.low, reference ? reference.low : Infinity), Math.max(found.high, limit ? found.low + limit : -Infinity, reference ? reference.high : -Infinity));
    const { phases, carpet } = found;
    C.waveform(canvas("waveform"), { values: carpet, places: PLACES, phases, turn, low: found.low, high: found.high, scale, reference: reference && reference.carpet, limit, met });
    carpetAxes = C.carpet(canvas("carpet"), { values: carpet, places: PLACES, phases, turn, scale, table: scales.sequential });
    C.orders(canvas("orders"), {
      rows: orders.map((one, i) => ({ symbol: one.symbol, amplitude: found.amplitudes[i], reference: reference ? reference.amplitudes[i] : undefined })),
      top: axisTop("orders", Math.max(...found.amplitudes, ...(reference ? reference.amplitudes : []), 1e-6)),
    });
    drawRing(found.ring);
    wantPath(); wantCloud();
    drawSpread();
    drawn++;
    times.push(performance.now() - start);
    if (times.length > 60) times.shift();
  };

  const sizes = () => ["contact", "bending"].map((name) => `${canvas(name).clientWidth} ${canvas(name).clientHeight}`).join();
  let ringShown = "";
  const drawRing = ({ key, contact, bending, overlap, bent }) => {
    const shown = `${key} ${sizes()} ${devicePixelRatio} ${document.documentElement.dataset.theme}`;
    if (shown === ringShown) return;
    ringShown = shown;
    C.quarter(canvas("contact"), contact.why && !overlap ? contact : {
      values: overlap, yTitle: "overlap [mm]", mark: contact.angle === undefined ? null : (contact.angle * 180) / Math.PI, fill: true,
    });
    C.quarter(canvas("bending"), bending.why ? bending : {
      values: bent, yTitle: gear.modulus === null ? "change of curvature [1/m]" : "stress [MPa]",
      level: gear.modulus === null ? null : gear.endurance, levelName: "endurance limit",
    });
  };

  // What the slices above add to; all else stays as it is.
  const drawSpread = () => {
    const value = judged(found), met = requirement ? value <= requirement.limit : null;
    drawCloud(value, met);
    say(value, met);
  };

  const drawCloud = (value, met) => {
    const one = byKey.get(against), index = errorKeys.indexOf(against);
    let points = null, histogram = null, most = value;
    if (cloud) {
      const known = spread.y.subarray(0, spread.known);
      histogram = new Array(BINS).fill(0);
      for (const y of known) if (y > most) most = y;
      points = index < 0 ? null : { x: columns[index], y: known };
    }
    for (const y of path.y) if (y > most) most = y;
    const top = axisTop("cloud", Math.max(most, requirement ? requirement.limit : 0));
    if (histogram) for (let i = 0; i < spread.known; i++) histogram[Math.min(BINS - 1, Math.floor((spread.y[i] / top) * BINS))]++;
    C.cloud(canvas("cloud"), {
      points, histogram, top, xs: [one.low, one.high], xTitle: `${one.label} [${one.unit}]`,
      path: path.against === against ? path : null, now: [values[against], value],
      reference: reference && [reference.values[against], judged(reference)], limit: requirement && requirement.limit, metNow: met,
    });
  };

  // ---- figures in words ---------------------------------------------------------------------------------------------

  const figures = new Map();
  const figure = (name, label, className = "") => {
    const box = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
    box.className = className;
    dt.textContent = label;
    box.append(dt, dd);
    $("figures").append(box);
    figures.set(name, dd);
  };
  const show = (name, number, unit, by = "", className = "") => {
    const dd = figures.get(name), text = `${number} ${unit} ${by} ${className}`;
    if (dd.shown === text) return;
    dd.shown = text;
    dd.replaceChildren(number, Object.assign(document.createElement("span"), { className: "unit", textContent: ` ${unit}` }));
    if (by) dd.append(Object.assign(document.createElement("span"), { className: `by ${className}`, textContent: by }));
  };

  const say = (value, met) => {
    const { ring, peakToPeak, evened } = found;
    const by = requirement ? `${met ? "met" : "missed"}: ${C.short(Math.abs(requirement.limit - value), 3)} ${met ? "to spare of" : "above"} ${C.short(requirement.limit)}` : "no requirement";
    show("peak", C.short(peakToPeak), "arcmin", requirement && requirement.evened ? "" : by, met === null ? "" : met ? "met" : "missed");
    show("evened", evened === null ? "–" : C.short(evened), "arcmin", requirement && requirement.evened ? by : "", met ? "met" : "missed");
    if (cloud) {
      const known = spread.known, whole = known === rows.length;
      let kept = 0;
      for (let i = 0; i < known; i++) if (spread.y[i] <= requirement.limit) kept++;
      const needs = `needs ${C.short(100 * requirement.yield)} %`, [least, most] = C.shareOf(kept, rows.length);
      const ends = `${C.short(100 * least)} to ${C.short(100 * most)} % by ${rows.length} drives`;
      // Met or missed only where the whole interval is: a few drives cannot tell 99 from 99.5 %.
      const decided = least >= requirement.yield ? "met" : most < requirement.yield ? "missed" : "";
      show("yield", whole ? C.short((100 * kept) / known) : "…", "%",
        whole ? `${needs}: ${decided || "not decided"}, ${ends}` : `computing: ${Math.round((100 * known) / rows.length)} %`, whole ? decided : "");
    }
    const { contact, bending } = ring;
    show("contact", contact.why ? "–" : C.short((contact.angle * 180) / Math.PI), "deg", contact.why ? "" : `${C.short(contact.teeth, 3)} teeth, k_e ${C.short(contact.homogenization, 3)}`);
    const stress = bending.stress ?? null;
    show("bending", bending.why ? "–" : C.short(stress === null ? 1000 * bending.change : stress), stress === null ? "1/m" : "MPa",
      stress !== null && gear.endurance ? `endurance ${C.short(gear.endurance)}` : "", stress > gear.endurance ? "missed" : "");
  };

  const describe = () => {
    const one = byKey.get(against), set = (name, text) => canvas(name).setAttribute("aria-label", text);
    set("waveform", `Kinematic error over input turn ${turn}, from ${C.short(found.low)} to ${C.short(found.high)} arcmin over the whole beat`);
    set("carpet", `Kinematic error over ${found.phases} input turns`);
    set("cloud", `Peak-to-peak ${C.short(judged(found))} arcmin at ${one.label} ${C.short(values[against])} ${one.unit}${cloud ? `, over the peak-to-peak of ${rows.length} drives of the tolerances` : ""}`);
    const strongest = found.amplitudes.indexOf(Math.max(...found.amplitudes));
    set("orders", `Largest order: ${orders[strongest].symbol} with ${C.short(found.amplitudes[strongest])} arcmin`);
    set("contact", found.ring.contact.why || `Tips overlap up to ${C.short((found.ring.contact.angle * 180) / Math.PI)} deg from the major axis`);
    set("bending", found.ring.bending.why || `Largest change of curvature ${C.short(1000 * found.ring.bending.change)} per metre`);
    $("speed").textContent = `Drawn in ${C.short(median(times), 2)} ms.`;
  };
  const median = (list) => [...list].sort((a, b) => a - b)[list.length >> 1];

  let quiet = 0;
  const schedule = () => {
    if (!waiting) { waiting = true; requestAnimationFrame(draw); }
    clearTimeout(quiet);
    quiet = setTimeout(() => { if (found) { describe(); writeHash(); } }, 250);
  };

  // ---- controls -----------------------------------------------------------------------------------------------------

  const controls = new Map();
  const element = (tag, properties = {}, ...children) => {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
  };
  const write = (one) => String(Number(values[one.key].toPrecision(6)));
  const onGrid = (one, value) => Math.min(one.high, Math.max(one.low, Number((Math.round(value / one.step) * one.step).toPrecision(10))));

  const symbolOf = (text) => {
    const [letter, index] = text.split("_"), made = element("i", {}, letter);
    if (index) made.append(element("sub", {}, index));
    return made;
  };

  const slider = (one) => {
    const id = `in-${one.key}`;
    const label = element("label", { htmlFor: id, title: `${one.label}: ${one.path}` }, one.short);
    if (one.symbol) label.append(" ", symbolOf(one.symbol));
    const box = element("input", { type: "text", id: `${id}-number`, inputMode: "decimal" });
    const range = element("input", { type: "range", id, min: one.low, max: one.high, step: "any" });
    const back = element("button", { type: "button", title: "Back to the study's value" }, "↺");
    back.setAttribute("aria-label", `${one.label}: back to the study's value`);
    box.setAttribute("aria-label", `${one.label} in ${one.unit}`);
    range.addEventListener("input", () => change(one.key, onGrid(one, Number(range.value)), range));
    range.addEventListener("keydown", (event) => {
      const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
      if (!by) return;
      event.preventDefault();
      change(one.key, onGrid(one, values[one.key] + by * one.step * (event.shiftKey ? 10 : 1)));
    });
    range.addEventListener("focus", () => look(one.key));
    box.addEventListener("change", () => {
      const why = fault(one, box.value);
      box.setAttribute("aria-invalid", String(Boolean(why)));
      if (why) tell(why); else { hush(); change(one.key, number(box.value), box); refresh(one); }
    });
    back.addEventListener("click", () => change(one.key, one.value));
    const row = element("div", { className: "row" }, label, box, element("span", { className: "unit" }, one.unit), back, range);
    controls.set(one.key, { row, range, box });
    return row;
  };

  const selector = (one) => {
    const select = element("select", { id: `in-${one.key}` }, ...one.options.map(([value, name]) => element("option", { value }, name)));
    select.addEventListener("change", () => change(one.key, select.value, select));
    const row = element("div", { className: "row choice" }, element("label", { htmlFor: select.id }, one.label), select);
    controls.set(one.key, { row, select });
    return row;
  };

  const build = () => {
    const groups = new Map();
    for (const one of [...choices, ...parameters]) {
      if (!groups.has(one.group)) groups.set(one.group, element("fieldset", {}, element("legend", {}, one.group)));
      groups.get(one.group).append(one.options ? selector(one) : slider(one));
    }
    $("controls").append(...groups.values());
    $("against").append(...parameters.map((one) => element("option", { value: one.key }, one.label)));
    figure("peak", "Peak-to-peak, converged", "first");
    figure("evened", "Evened out by the teeth in contact", "second");
    if (cloud) figure("yield", "Drives of the tolerances in the limit");
    figure("contact", "Contact angle", "second");
    figure("bending", gear.modulus === null ? "Change of curvature" : "Bending stress", "second");
  };

  const refresh = (one, from = null) => {
    const { row, range, box, select } = controls.get(one.key);
    if (select) { select.value = values[one.key]; return; }
    if (range !== from) range.value = values[one.key];
    if (box !== from) { box.value = write(one); box.setAttribute("aria-invalid", "false"); }
    range.setAttribute("aria-valuetext", `${write(one)} ${one.unit}`);
    row.classList.toggle("changed", values[one.key] !== one.value);
    if (one.key === "wrap_angle_deg") {
      row.classList.toggle("off", values.profile !== "two_disk");
      range.disabled = box.disabled = values.profile !== "two_disk";
    }
  };

  const look = (key) => {
    if (against === key || !byKey.get(key) || byKey.get(key).options) return;
    against = key;
    $("against").value = key;
    schedule();
  };

  const change = (key, value, from = null) => {
    values[key] = value;
    look(key);
    refresh(byKey.get(key), from);
    if (key === "profile") refresh(byKey.get("wrap_angle_deg"));
    schedule();
  };

  const showAll = () => { for (const one of byKey.values()) refresh(one); schedule(); };

  // ---- words about what cannot be taken -----------------------------------------------------------------------------

  const number = (text) => (/^\s*[+-−]?(\d+[.,]?\d*|[.,]\d+)(e[+-]?\d+)?\s*$/i.test(text) ? Number(text.replace(",", ".").replace("−", "-")) : NaN);
  const fault = (one, text) => {
    const value = number(text), shownText = text.length > 40 ? `${text.slice(0, 40)}…` : text;
    if (Number.isNaN(value)) return `${one.label} cannot be “${shownText}”: give a number in ${one.unit}, such as ${one.value}.`;
    if (value < one.low || value > one.high) {
      return `${one.label} cannot be ${shownText} ${one.unit} here: this page goes from ${one.low} to ${one.high} ${one.unit}. For more, take hdopt ke --set ${one.path}=${value}.`;
    }
    return "";
  };
  const tell = (text) => { $("message").hidden = false; $("message").querySelector("p").textContent = text; };
  const hush = () => { $("message").hidden = true; };

  // ---- the point in the address, as TOML and as --set ----------------------------------------------------------------

  const changed = () => [...byKey.values()].filter((one) => values[one.key] !== one.value && (one.key !== "wrap_angle_deg" || values.profile === "two_disk"));
  const told = (one) => (one.options ? values[one.key] : write(one));
  const hash = () => changed().map((one) => `${one.key}=${told(one)}`).join("&");
  let written = null;
  const writeHash = () => {
    const now = hash();
    if (now === written) return;
    written = now;
    try { history.replaceState(null, "", now ? `#${now}` : "#"); } catch { /* an embedded page has no address of its own */ }
  };

  const readHash = () => {
    values = atStudy();
    const faults = [], text = location.hash.slice(1);
    for (const part of text ? text.split("&") : []) {
      let [key, ...rest] = part.split("=");
      let value = rest.join("=");
      try { key = decodeURIComponent(key); value = decodeURIComponent(value); } catch {
        faults.push(`“${part.slice(0, 40)}” cannot be read.`);
        continue;
      }
      const one = byKey.get(key) || [...byKey.values()].find((other) => other.path === key);
      if (!one) faults.push(`“${key.slice(0, 40)}” is no value of this page.`);
      else if (one.options) {
        if (one.options.some(([name]) => name === value)) values[one.key] = value;
        else faults.push(`${one.label} cannot be “${value.slice(0, 40)}”: take one of ${one.options.map(([name]) => name).join(", ")}.`);
      } else {
        const why = fault(one, value);
        if (why) faults.push(why); else values[one.key] = number(value);
      }
    }
    written = text;
    if (faults.length) {
      const more = faults.length - 4;
      tell(`Of the address, this could not be taken; the study's own values stand instead.\n${faults.slice(0, 4).join("\n")}${more > 0 ? `\nand ${more} more` : ""}`);
    } else hush();
    showAll();
  };

  const toml = () => {
    let text = data.toml;
    for (const one of byKey.values()) text = text.replaceAll(`"@${one.path}@"`, one.options ? `"${values[one.key]}"` : told(one));
    return text;
  };
  const settings = () => {
    const flags = changed().map((one) => `--set ${one.path}=${told(one)}`);
    return [`hdopt ke ${data.command}`, ...flags].join(" ");
  };

  const copy = async (text, what) => {
    $("copied").hidden = false;
    const area = $("copied").querySelector("textarea");
    area.value = text;
    let taken = true;
    try { await navigator.clipboard.writeText(text); } catch { area.select(); taken = document.execCommand("copy"); }
    $("copied").querySelector("p").textContent = taken ? `${what} copied.` : `${what}: select the text and copy it.`;
  };

  const hold = (from) => {
    const { low, high, peakToPeak, evened, carpet, amplitudes } = evaluate(from, null);
    reference = { values: { ...from }, low, high, peakToPeak, evened, carpet, amplitudes };
    schedule();
  };

  const theme = (dark) => {
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    $("theme").setAttribute("aria-pressed", String(dark));
    C.readTheme();
    schedule();
  };

  let carpetAxes = null;
  const pickTurn = (event) => {
    if (!carpetAxes || !found || (event.type === "pointermove" && !event.buttons)) return;
    const y = event.clientY - canvas("carpet").getBoundingClientRect().top;
    const share = (carpetAxes.bottom - y) / (carpetAxes.bottom - carpetAxes.top);
    setTurn(Math.max(0, Math.min(found.phases - 1, Math.floor(share * found.phases))));
  };
  const setTurn = (value) => {
    turn = value;
    $("turn").value = value;
    $("turn").nextElementSibling.textContent = `${value}`;
    schedule();
  };

  const connect = () => {
    $("copy-link").addEventListener("click", () => { writeHash(); copy(location.href, "Link"); });
    $("copy-toml").addEventListener("click", () => copy(toml(), "Study file"));
    $("copy-set").addEventListener("click", () => copy(settings(), "Command"));
    $("hold").addEventListener("click", () => hold(values));
    $("reset").addEventListener("click", () => { values = atStudy(); hush(); hold(values); showAll(); });
    $("theme").addEventListener("click", () => theme(document.documentElement.dataset.theme !== "dark"));
    for (const id of ["message", "copied"]) $(id).querySelector("button").addEventListener("click", () => { $(id).hidden = true; });
    $("against").addEventListener("change", () => look($("against").value));
    $("turn").addEventListener("input", () => setTurn(Number($("turn").value)));
    canvas("carpet").addEventListener("pointerdown", pickTurn);
    canvas("carpet").addEventListener("pointermove", pickTurn);
    $("controls").addEventListener("submit", (event) => event.preventDefault());
    addEventListener("hashchange", readHash);
    new ResizeObserver(() => { C.readTheme(); schedule(); }).observe(document.querySelector(".views .waveform canvas"));
    addEventListener("resize", () => { C.readTheme(); schedule(); });
  };

  // ---- for scripts: set a point, wait until all of it is drawn, measure frames ---------------------------------------

  const frame = () => new Promise((done) => requestAnimationFrame(() => done(performance.now())));
  const settled = async () => {
    for (;;) {
      await frame();
      if (!waiting && found && path.key === pathKey() && (!cloud || spread.known === rows.length)) return found;
    }
  };
  // Frames a second while the input `key` is moved to and fro once a frame, and what one frame takes, ms.
  const measure = async (key, frames = 120) => {
    const one = byKey.get(key), before = values[key];
    times.length = 0;
    const start = await frame(), first = drawn;
    for (let i = 0; i < frames; i++) {
      change(key, onGrid(one, one.low + (one.high - one.low) * (0.5 + 0.5 * Math.sin((2 * Math.PI * i) / 60))));
      await frame();
    }
    const seconds = ((await frame()) - start) / 1000, shown = drawn - first;
    const result = { frames_per_second: shown / seconds, frame_ms: median(times), slowest_ms: Math.max(...times) };
    change(key, before);
    return result;
  };

  build();
  connect();
  theme(matchMedia("(prefers-color-scheme: dark)").matches);
  $("against").value = against;
  $("turn").max = F.drive(gear, designOf(values), errorKeys.map(() => 0)).phases - 1;
  setTurn(0);
  hold(atStudy());
  readHash();
  globalThis.hdoptExplorer = { data, change, settled, measure, toml, settings, hash, value: () => ({ ...values }), found: () => found, pick: setTurn };
  globalThis.hdoptReport = { drawn: settled() };
})();
