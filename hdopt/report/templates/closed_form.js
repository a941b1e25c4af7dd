"use strict";
// The closed form of hdopt.kinematics in JavaScript, and with it contact and bending: what the explorer draws from.
// Lengths in mm, angles in rad, kinematic error in arcmin with k_e = 1. Names, equations and sources are those of
// hdopt/kinematics/closed_form.py, essential.py, hdopt/drive/profiles.py, hdopt/mechanics/contact.py and bending.py;
// tests/browser/test_explorer.py holds the two together at 10,000 random settings.
globalThis.HdoptClosedForm = (() => {
  const ARCMIN = Math.PI / 10800;
  const TURN = 2 * Math.PI;

  // ---- profiles: r(phi) of the loaded flexspline's inner wall, phi from the major axis ------------------------------

  const ellipse = (a, b) => ({
    name: "ellipse",
    semiMajor: a,
    radius(phi, derivative = 0) {
      const g = (b * Math.cos(phi)) ** 2 + (a * Math.sin(phi)) ** 2;
      const g1 = (a * a - b * b) * Math.sin(2 * phi), g2 = 2 * (a * a - b * b) * Math.cos(2 * phi);
      if (derivative === 0) return (a * b) / Math.sqrt(g);
      if (derivative === 1) return -0.5 * a * b * g1 * g ** -1.5;
      return a * b * (0.75 * g1 * g1 * g ** -2.5 - 0.5 * g2 * g ** -1.5);
    },
  });

  // Resal's curve is the two-disk curve of zero wrap.
  const twoDisk = (name, undeformed, deflection, wrap) => {
    const rest = Math.PI / 2 - wrap, sinWrap = Math.sin(wrap);
    const a = rest - sinWrap * Math.cos(wrap), b = (4 / Math.PI) * (Math.cos(wrap) - rest * sinWrap);
    const scale = deflection / (a - b);
    return {
      name,
      semiMajor: undeformed + deflection,
      radius(angle, derivative = 0) {
        const half = ((angle % Math.PI) + Math.PI) % Math.PI, second = half > Math.PI / 2;
        const phi = second ? Math.PI - half : half, sign = second ? -1 : 1;
        const sin = Math.sin(phi), cos = Math.cos(phi), left = Math.PI / 2 - phi, onDisc = phi <= wrap;
        if (derivative === 0) {
          const free = (1 + sinWrap ** 2) * sin + left * cos - 2 * sinWrap - b;
          return undeformed + scale * (onDisc ? a * cos - b : free);
        }
        if (derivative === 1) return sign * scale * (onDisc ? -a * sin : sinWrap ** 2 * cos - left * sin);
        return scale * (onDisc ? -a * cos : (1 - sinWrap ** 2) * sin - left * cos);
      },
    };
  };

  const PROFILES = {
    ellipse: (gear) => ellipse(gear.semiMajor, gear.semiMinor),
    resal: (gear) => twoDisk("resal", gear.innerRadius, gear.semiMajor - gear.innerRadius, 0),
    two_disk: (gear, wrap) => twoDisk("two_disk", gear.innerRadius, gear.semiMajor - gear.innerRadius, wrap),
  };

  const polarCurvature = (r, r1, r2) => (r * r + 2 * r1 * r1 - r * r2) / (r * r + r1 * r1) ** 1.5;

  const tipRadius = (profile) => 1 / polarCurvature(profile.radius(0), profile.radius(0, 1), profile.radius(0, 2));

  // ---- contact and bending ------------------------------------------------------------------------------------------

  const tipOverlap = (gear, profile, phi) => {
    const deflection = profile.radius(phi) - gear.innerRadius;
    const flexsplineTip = (gear.module * gear.fsTeeth) / 2 + deflection + gear.fsAddendum;
    return flexsplineTip - ((gear.module * gear.csTeeth) / 2 - gear.csAddendum);
  };

  // {angle, teeth, homogenization}, or {why} where there is none: nobody gave the addenda, or the tips never part.
  const contact = (gear, profile) => {
    if (gear.fsAddendum === null || gear.csAddendum === null) return { why: "needs the addenda of both splines" };
    const atMajor = tipOverlap(gear, profile, 0), atMinor = tipOverlap(gear, profile, Math.PI / 2);
    if (atMajor <= 0) return { why: `the tips miss each other by ${(-atMajor).toPrecision(3)} mm` };
    if (atMinor >= 0) return { why: `the teeth overlap all round, by ${atMinor.toPrecision(3)} mm on the minor axis` };
    let low = 0, high = Math.PI / 2;
    for (let i = 0; i < 60; i++) {
      const middle = (low + high) / 2;
      if (tipOverlap(gear, profile, middle) > 0) low = middle; else high = middle;
    }
    const angle = (low + high) / 2, teeth = (gear.csTeeth * angle) / TURN;
    return { angle, teeth, homogenization: 1 / Math.sqrt(teeth) };
  };

  const curvatureChange = (gear, profile, phi) => {
    const half = gear.wall / 2;
    const bent = polarCurvature(profile.radius(phi) + half, profile.radius(phi, 1), profile.radius(phi, 2));
    return bent - 1 / (gear.innerRadius + half);
  };

  const QUARTER_PLACES = 3600;

  // {change (1/mm), stress (MPa or null)}, the largest along the ring, or {why} where the wall is not given.
  const bending = (gear, profile) => {
    if (gear.wall === null) return { why: "needs the flexspline's wall" };
    let change = 0;
    for (let i = 0; i <= QUARTER_PLACES; i++) {
      change = Math.max(change, Math.abs(curvatureChange(gear, profile, ((Math.PI / 2) * i) / QUARTER_PLACES)));
    }
    return { change, stress: gear.modulus === null ? null : (gear.modulus * gear.wall * change) / 2 };
  };

  // ---- one drive at one setting -------------------------------------------------------------------------------------

  const STRUCTURES = {
    integral: [1, 1],
    automatic: [0, 0],
    one_way_major: [0, 1],
    one_way_minor: [1, 0],
  };

  const greatestCommonDivisor = (a, b) => (b ? greatestCommonDivisor(b, a % b) : a);

  // What is computed once for a setting. `gear`: what no slider moves; `design`: pressureAngle, width, profile,
  // structure, wrapAngle; `errors`: the twelve, in the order of hdopt.drive.errors.ERROR_NAMES.
  const drive = (gear, design, errors) => {
    const [e1, beta1, beta2, beta3, e2, alpha1, alpha2, alpha3, aCs, phiCs, aFs, phiFs] = errors;
    const profile = PROFILES[design.profile](gear, design.wrapAngle);
    const [major, minor] = STRUCTURES[design.structure];
    const half = design.width / 2, rho = tipRadius(profile), length = profile.semiMajor;
    const tanX = Math.tan(beta3), tanY = Math.tan(beta2), tanMajor = Math.tan(alpha2), tanMinor = Math.tan(alpha3);
    const x1 = e1 * Math.sin(beta1), y1 = e1 * Math.cos(beta1);
    return {
      profile,
      tanAlpha: Math.tan(design.pressureAngle),
      advance: gear.csTeeth / gear.fsTeeth,
      phases: gear.fsTeeth / greatestCommonDivisor(gear.fsTeeth, gear.csTeeth),
      arcminPerMm: TURN / (Math.PI * gear.module * gear.fsTeeth) / ARCMIN,
      rim: {
        tiltGain: (length + rho) / 2 / (half * half),
        bow: length / 2 / (half * half),
        perFlatness: 1 / (length - rho),
        perMajor: 1 / length,
      },
      motion: {
        eaCos: major * y1, eaSin: major * x1, ea0: major * e2 * Math.cos(alpha1),
        elCos: minor * x1, elSin: -minor * y1, el0: minor * e2 * Math.sin(alpha1),
        taCos: half * tanY, taSin: half * tanX, ta0: half * tanMajor,
        tlCos: half * tanX, tlSin: -half * tanY, tl0: half * tanMinor,
        twistCos: (tanY * tanMinor - tanX * tanMajor) / 2,
        twistSin: (tanX * tanMinor + tanY * tanMajor) / 2,
        twist0: (tanX * tanY + tanMajor * tanMinor) / 2,
      },
      csCos: aCs * Math.sin(phiCs), csSin: aCs * Math.cos(phiCs),
      fsCos: aFs * Math.sin(phiFs), fsSin: aFs * Math.cos(phiFs),
    };
  };

  // Depth and offsets o, o' of both rims in both zones at one input angle: out[3 (2 zone + rim) + (0, 1, 2)].
  const branches = ({ motion: m, rim }, cos, sin, out) => {
    const ea = m.eaCos * cos + m.eaSin * sin + m.ea0;
    const twist = m.twistCos * cos + m.twistSin * sin + m.twist0;
    const el = m.elCos * cos + m.elSin * sin + m.el0 - ea * twist;
    const ta = m.taCos * cos + m.taSin * sin + m.ta0, tl = m.tlCos * cos + m.tlSin * sin + m.tl0;
    for (let i = 0, at = 0; i < 4; i++, at += 3) {
      const s = i < 2 ? 1 : -1, k = i % 2 ? -1 : 1;
      const shift = el + s * k * tl, q = shift - s * rim.tiltGain * ta * tl;
      out[at] = s * ea + k * ta - rim.bow * ta * ta + (q * q * rim.perFlatness) / 2;
      out[at + 1] = q * rim.perFlatness;
      out[at + 2] = q * rim.perFlatness - shift * rim.perMajor;
    }
  };

  const scratch = new Float64Array(12);

  // Of both zones at angle theta, following rims[zone]: deviation without the FS teeth (mm of arc), and the cosine and
  // sine part of the FS sine over its phase: out[at + 3 zone + (0, 1, 2)].
  const node = (it, rims, theta, out, at) => {
    const cos = Math.cos(theta), sin = Math.sin(theta);
    branches(it, cos, sin, scratch);
    for (let zone = 0; zone < 2; zone++) {
      const s = 1 - 2 * zone, from = 3 * (2 * zone + rims[zone]), o = scratch[from + 1];
      const here = it.csCos * cos + it.csSin * sin, ahead = it.csSin * cos - it.csCos * sin;
      out[at + 3 * zone] = it.tanAlpha * scratch[from] + s * here * Math.cos(o) + ahead * Math.sin(o);
      const angle = it.advance * theta + s * scratch[from + 2], c = Math.cos(angle), n = Math.sin(angle);
      out[at + 3 * zone + 1] = s * (it.fsCos * c + it.fsSin * n);
      out[at + 3 * zone + 2] = s * (it.fsSin * c - it.fsCos * n);
    }
  };

  const TIE_MM = 1e-12;

  const deepestRims = (it, theta, rims) => {
    branches(it, Math.cos(theta), Math.sin(theta), scratch);
    rims[0] = scratch[0] >= scratch[3] - TIE_MM ? 0 : 1;
    rims[1] = scratch[6] >= scratch[9] - TIE_MM ? 0 : 1;
  };

  // The kinematic error of a full relative turn, arcmin: row p is input turn p, column j the angle 2 pi j/places.
  const carpet = (it, places, out = new Float32Array(it.phases * places)) => {
    const at = new Float64Array(6), rims = [0, 0], { phases, arcminPerMm } = it;
    const cos = new Float64Array(phases), sin = new Float64Array(phases);
    for (let p = 0; p < phases; p++) { cos[p] = Math.cos(TURN * it.advance * p); sin[p] = Math.sin(TURN * it.advance * p); }
    for (let j = 0; j < places; j++) {
      const theta = (TURN * j) / places;
      deepestRims(it, theta, rims);
      node(it, rims, theta, at, 0);
      const [one, oneCos, oneSin, two, twoCos, twoSin] = at;
      for (let p = 0; p < phases; p++) {
        const first = one + oneCos * cos[p] + oneSin * sin[p], second = two + twoCos * cos[p] + twoSin * sin[p];
        out[p * places + j] = arcminPerMm * (first > second ? first : second);
      }
    }
    return out;
  };

  // ---- converged extremes over the full relative turn: hdopt.kinematics.essential -----------------------------------

  const PLACES = 360, SHORT = 0.5, SAFETY = 2, ROOT_STEPS = 60;
  const FINEST_MM = 1e-10; // what is left of a cell's bend when it is no longer halved: 1e-8 arcmin

  // Upper rim's depth less the lower one's in a zone at a place, in cells.
  const rimGap = (it, zone, place) => {
    const theta = (TURN * place) / PLACES;
    branches(it, Math.cos(theta), Math.sin(theta), scratch);
    return scratch[6 * zone] - scratch[6 * zone + 3];
  };

  const root = (it, zone, low, high) => {
    const lowIsUpper = rimGap(it, zone, low) >= 0;
    for (let i = 0; i < ROOT_STEPS && high - low > 1e-14 * PLACES; i++) {
      const middle = (low + high) / 2;
      if (rimGap(it, zone, middle) >= 0 === lowIsUpper) low = middle; else high = middle;
    }
    return (low + high) / 2;
  };

  // Places of one turn where a zone's deepest rim changes, pairs within a cell too.
  const rimChanges = (it, zone, gaps, found) => {
    if (gaps.every((gap) => Math.abs(gap) <= TIE_MM)) return;
    for (let j = 0; j < PLACES; j++) {
      const before = gaps[(j + PLACES - 1) % PLACES], here = gaps[j], after = gaps[(j + 1) % PLACES];
      if (here >= 0 !== after >= 0) {
        found.push(root(it, zone, j, j + 1));
      } else if (before >= 0 === here >= 0 && Math.abs(here) <= Math.abs(before) && Math.abs(here) <= Math.abs(after)) {
        const bend = before - 2 * here + after, vertex = j + (bend ? (0.5 * (before - after)) / bend : 0);
        if (rimGap(it, zone, vertex) >= 0 !== here >= 0) {
          found.push(root(it, zone, j - 1, vertex), root(it, zone, vertex, j + 1));
        }
      }
    }
  };

  // Stretches between changes, each with its deepest rims and its places; those where rims only tie are left out.
  const stretches = (it) => {
    const marks = [];
    for (let zone = 0; zone < 2; zone++) {
      const gaps = Array.from({ length: PLACES }, (_, j) => rimGap(it, zone, j));
      rimChanges(it, zone, gaps, marks);
    }
    if (!marks.length) marks.push(0);
    marks.sort((a, b) => a - b);
    marks.push(marks[0] + PLACES);
    const found = [];
    for (let i = 0; i + 1 < marks.length; i++) {
      const low = marks[i], high = marks[i + 1], gaps = [0, 1].map((zone) => rimGap(it, zone, (low + high) / 2));
      const real = high > low && gaps.every((gap) => high - low > SHORT || Math.abs(gap) > TIE_MM);
      if (!real) continue;
      const places = [low];
      for (let j = Math.floor(low) + 1; j < Math.ceil(high); j++) places.push(j);
      places.push(high);
      found.push({ rims: gaps.map((gap) => (gap >= -TIE_MM ? 0 : 1)), places });
    }
    return found;
  };

  const leastOfLines = (oneA, twoA, oneB, twoB) => {
    const least = Math.min(Math.max(oneA, twoA), Math.max(oneB, twoB)), a = oneA - twoA, b = oneB - twoB;
    return a * b < 0 ? Math.min(least, (oneA * b - oneB * a) / (b - a)) : least;
  };

  const length = (x, y) => Math.sqrt(x * x + y * y); // Math.hypot is many times slower

  // A node with what holds at it for every phase, from the sinusoid A + R cos(phase - psi) of each zone: A - R of both,
  // the lowest mean of the zones, the highest of either.
  const bounded = (it, rims, place) => {
    const n = new Float64Array(10);
    node(it, rims, (TURN * place) / PLACES, n, 0);
    const one = length(n[1], n[2]), two = length(n[4], n[5]);
    n[6] = n[0] - one;
    n[7] = n[3] - two;
    n[8] = (n[0] + n[3] - length(n[1] + n[4], n[2] + n[5])) / 2;
    n[9] = Math.max(n[0] + one, n[3] + two);
    return n;
  };

  // The larger of two lines over a cell is nowhere below the smaller end of either, nor of their mean.
  const floorOf = (a, b) => Math.max(Math.min(a[6], b[6]), Math.min(a[7], b[7]), Math.min(a[8], b[8]));

  // Nodes of a stretch, and how much a whole cell bends at most, whatever the phase; those at its ends are shorter.
  const sample = (it, piece) => {
    const nodes = (piece.nodes = piece.places.map((place) => bounded(it, piece.rims, place)));
    let bend = 0;
    for (let i = 2; i < nodes.length - 2; i++) {
      const [a, b, c] = [nodes[i - 1], nodes[i], nodes[i + 1]], second = (k) => a[k] - 2 * b[k] + c[k];
      for (const k of [0, 3]) bend = Math.max(bend, Math.abs(second(k)) + length(second(k + 1), second(k + 2)));
    }
    return bend;
  };

  // The extremes in a cell between two nodes, found by halving it as long as it may hold one beyond `best`: a smooth
  // deviation lies within `margin` of the line between its ends, and within a quarter of that when the cell is halved.
  const refine = (it, rims, [low, a], [high, b], phases, margin, best) => {
    const least = floorOf(a, b) - margin < best[0], most = Math.max(a[9], b[9]) + margin > best[1];
    if (!(least || most)) return;
    const finest = margin < FINEST_MM;
    const kept = [];
    for (const phase of phases) {
      const [c, s] = phase;
      const oneA = a[0] + a[1] * c + a[2] * s, twoA = a[3] + a[4] * c + a[5] * s;
      const oneB = b[0] + b[1] * c + b[2] * s, twoB = b[3] + b[4] * c + b[5] * s;
      const more = Math.max(oneA, twoA), other = Math.max(oneB, twoB);
      best[0] = Math.min(best[0], more, other);
      best[1] = Math.max(best[1], more, other);
      const lines = leastOfLines(oneA, twoA, oneB, twoB);
      if (finest) best[0] = Math.min(best[0], lines);
      else if (lines - margin < best[0] || Math.max(more, other) + margin > best[1]) kept.push(phase);
    }
    if (!kept.length) return;
    const middle = (low + high) / 2, between = [middle, bounded(it, rims, middle)];
    refine(it, rims, [low, a], between, kept, margin / 4, best);
    refine(it, rims, between, [high, b], kept, margin / 4, best);
  };

  // Essential infimum and supremum of the kinematic error over one full relative turn, arcmin.
  const extremes = (it) => {
    const phases = Array.from({ length: it.phases }, (_, p) => [Math.cos((TURN * p) / it.phases), Math.sin((TURN * p) / it.phases)]);
    const pieces = stretches(it), best = [Infinity, -Infinity];
    let bend = 0;
    for (const piece of pieces) bend = Math.max(bend, sample(it, piece));
    const margin = (SAFETY * bend) / 8, cells = [];
    for (const { places, rims, nodes } of pieces) {
      for (let i = 0; i + 1 < places.length; i++) {
        const [a, b] = [nodes[i], nodes[i + 1]];
        cells.push({ rims, from: [places[i], a], to: [places[i + 1], b], floor: floorOf(a, b), top: Math.max(a[9], b[9]) });
      }
    }
    // The most promising cells first: what they hold rules out most of the others.
    const lowest = cells.reduce((one, other) => (other.floor < one.floor ? other : one));
    const highest = cells.reduce((one, other) => (other.top > one.top ? other : one));
    for (const { rims, from, to } of [lowest, highest, ...cells]) refine(it, rims, from, to, phases, margin, best);
    return [best[0] * it.arcminPerMm, best[1] * it.arcminPerMm];
  };

  const peakToPeak = (it) => { const [low, high] = extremes(it); return high - low; };

  // ---- orders -------------------------------------------------------------------------------------------------------

  // Amplitudes (arcmin) at `orders` (cycles an input turn) of a carpet of so many phases and places, as a function of it.
  // Every order of the model has a whole number of cycles in the full relative turn: projections are the least squares.
  const amplitudesAt = (phases, places, orders) => {
    const waves = (count, cycles, whole) => [Math.cos, Math.sin].map((wave) => (
      Float64Array.from({ length: count }, (_, i) => wave((TURN * ((i * cycles) % whole)) / whole))
    ));
    const cycles = orders.map((order) => Math.round(order * phases)), folds = [...new Set(cycles.map((count) => count % phases))];
    const overTurns = folds.map((fold) => waves(phases, fold, phases));
    const within = cycles.map((count) => waves(places, count, phases * places));
    return (values) => {
      const sums = overTurns.map(([cos, sin]) => {
        const re = new Float64Array(places), im = new Float64Array(places);
        for (let p = 0, v = 0; p < phases; p++) {
          for (let j = 0; j < places; j++, v++) { re[j] += values[v] * cos[p]; im[j] += values[v] * sin[p]; }
        }
        return [re, im];
      });
      return cycles.map((count, i) => {
        const [re, im] = sums[folds.indexOf(count % phases)], [cos, sin] = within[i];
        let x = 0, y = 0;
        for (let j = 0; j < places; j++) { x += re[j] * cos[j] - im[j] * sin[j]; y += re[j] * sin[j] + im[j] * cos[j]; }
        return (2 * length(x, y)) / (phases * places);
      });
    };
  };

  return { drive, carpet, extremes, peakToPeak, amplitudesAt, contact, bending, tipOverlap, curvatureChange, PROFILES };
})();
