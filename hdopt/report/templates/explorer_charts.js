"use strict";
// The explorer's views on canvas: each is a function of what is to be shown and of the colours of the page's theme.
globalThis.HdoptCharts = (() => {
  const FONT = '"Segoe UI", "Helvetica Neue", Roboto, "Liberation Sans", Arial, sans-serif';
  const NAMES = ["ink", "muted", "grid", "axis", "paper", "accent", "good", "bad", "cloud", "reference", "band"];
  let colours = {};
  let size = 11;
  const readTheme = () => {
    const style = getComputedStyle(document.documentElement);
    colours = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    size = innerWidth > 1760 ? 14 : 11;
  };

  // A number in `digits` significant digits, without a tail of zeros, with a true minus.
  const short = (value, digits = 4) => {
    if (!Number.isFinite(value)) return "–";
    const text = String(Number(value.toPrecision(digits)));
    return text.startsWith("-") ? `−${text.slice(1)}` : text;
  };

  // Ends of the share that `kept` of `count` drawn alike hold at 95 % (Wilson 1927): 256 of 256 are at least 0.985.
  const shareOf = (kept, count) => {
    const z = 1.959964, share = kept / count, more = (z * z) / count;
    const middle = share + more / 2, reach = z * Math.sqrt((share * (1 - share)) / count + more / (4 * count));
    return [Math.max(0, (middle - reach) / (1 + more)), Math.min(1, (middle + reach) / (1 + more))];
  };

  const ticks = (low, high, most) => {
    const rough = (high - low) / Math.max(1, most), power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
    const found = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i++) found.push(Number((i * step).toPrecision(12)));
    return found;
  };

  // The canvas at the screen's own resolution, cleared; null while it has no size.
  const begin = (canvas) => {
    const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return null;
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const ctx = canvas.getContext("2d");
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, width, height);
    ctx.font = `${size}px ${FONT}`;
    ctx.lineJoin = "bevel";
    return { ctx, width, height };
  };

  // Axes with ticks and titles: {x, y} map values to pixels. `room`: left, right, top, bottom around the plot, px.
  const axes = ({ ctx, width, height }, { xs, ys, xTitle, yTitle, xTicks, right = 10, yNames = null }) => {
    const grow = size / 11;
    const yMarks = yNames ? yNames.map((_, i) => i) : ticks(ys[0], ys[1], Math.max(2, height / (42 * grow)));
    const names = yNames || yMarks.map((value) => short(value));
    const left = Math.max(...names.map((name) => ctx.measureText(name).width)) + (yTitle ? 26 : 12) * grow;
    const room = { left, right, top: 8, bottom: 34 * grow };
    const x = (value) => left + ((value - xs[0]) / (xs[1] - xs[0])) * (width - left - right);
    const y = (value) => height - room.bottom - ((value - ys[0]) / (ys[1] - ys[0])) * (height - room.top - room.bottom);
    ctx.lineWidth = 1;
    ctx.fillStyle = colours.muted;
    ctx.textAlign = "right"; ctx.textBaseline = "middle";
    yMarks.forEach((value, i) => {
      const at = Math.round(y(value)) + 0.5;
      if (!yNames) { ctx.strokeStyle = colours.grid; line(ctx, [[left, at], [width - right, at]]); }
      ctx.fillText(names[i], left - 6, at);
    });
    ctx.textAlign = "center"; ctx.textBaseline = "top";
    for (const value of xTicks || ticks(xs[0], xs[1], Math.max(2, (width - left) / (70 * grow)))) {
      const at = Math.round(x(value)) + 0.5;
      ctx.strokeStyle = colours.axis;
      line(ctx, [[at, height - room.bottom], [at, height - room.bottom + 4]]);
      ctx.fillText(short(value), at, height - room.bottom + 6);
    }
    ctx.strokeStyle = colours.axis;
    line(ctx, [[left + 0.5, room.top], [left + 0.5, height - room.bottom + 0.5], [width - right, height - room.bottom + 0.5]]);
    ctx.fillText(xTitle, (left + width - right) / 2, height - 12 * grow);
    if (yTitle) {
      ctx.save();
      ctx.translate(2, (height - room.bottom + room.top) / 2);
      ctx.rotate(-Math.PI / 2);
      ctx.fillText(yTitle, 0, 0);
      ctx.restore();
    }
    return { x, y, left, right: width - right, top: room.top, bottom: height - room.bottom };
  };

  const line = (ctx, points) => {
    ctx.beginPath();
    points.forEach(([x, y], i) => (i ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
    ctx.stroke();
  };

  const curve = (ctx, at, xs, ys, colour, width = 2) => {
    ctx.strokeStyle = colour; ctx.lineWidth = width;
    ctx.beginPath();
    for (let i = 0; i < xs.length; i++) i ? ctx.lineTo(at.x(xs[i]), at.y(ys[i])) : ctx.moveTo(at.x(xs[i]), at.y(ys[i]));
    ctx.stroke();
  };

  const words = (ctx, text, x, y, colour, align = "left", baseline = "middle") => {
    ctx.textAlign = align; ctx.textBaseline = baseline;
    ctx.lineWidth = 3; ctx.strokeStyle = colours.paper; ctx.strokeText(text, x, y);
    ctx.fillStyle = colour; ctx.fillText(text, x, y);
  };

  // A measure with end marks, as in a drawing, from `low` to `high` at x.
  const bracket = (ctx, at, x, low, high, colour, text) => {
    ctx.strokeStyle = colour; ctx.lineWidth = 2;
    const [a, b] = [at.y(low), at.y(high)];
    line(ctx, [[x - 4, b], [x + 4, b]]); line(ctx, [[x, b], [x, a]]); line(ctx, [[x - 4, a], [x + 4, a]]);
    ctx.save();
    ctx.translate(x + 5, (a + b) / 2); ctx.rotate(-Math.PI / 2);
    words(ctx, text, 0, 0, colour, "center", "top");
    ctx.restore();
  };

  const DEGREES = Array.from({ length: 361 }, (_, i) => i);

  const turnOf = (values, places, turn) => DEGREES.map((_, j) => values[turn * places + (j % places)]);

  const waveform = (canvas, { values, places, phases, turn, low, high, scale, reference, limit, met }) => {
    const on = begin(canvas);
    if (!on) return;
    const { ctx, width } = on;
    const at = axes(on, {
      xs: [0, 360], ys: scale, xTitle: "input angle [deg]", yTitle: "error [arcmin]",
      xTicks: width < 500 ? [0, 90, 180, 270, 360] : [0, 60, 120, 180, 240, 300, 360], right: (limit ? 5.3 : 3.1) * size,
    });
    const least = new Float32Array(places).fill(Infinity), most = new Float32Array(places).fill(-Infinity);
    for (let p = 0, v = 0; p < phases; p++) {
      for (let j = 0; j < places; j++, v++) {
        if (values[v] < least[j]) least[j] = values[v];
        if (values[v] > most[j]) most[j] = values[v];
      }
    }
    ctx.fillStyle = colours.band;
    ctx.beginPath();
    for (let j = 0; j <= places; j++) ctx.lineTo(at.x((360 * j) / places), at.y(most[j % places]));
    for (let j = places; j >= 0; j--) ctx.lineTo(at.x((360 * j) / places), at.y(least[j % places]));
    ctx.fill();
    if (reference) curve(ctx, at, DEGREES, turnOf(reference, places, turn), colours.reference, 1.5);
    curve(ctx, at, DEGREES, turnOf(values, places, turn), colours.accent, 2.5);
    const colour = met === null ? colours.ink : met ? colours.good : colours.bad;
    bracket(ctx, at, at.right + size, low, high, colour, short(high - low));
    if (limit) bracket(ctx, at, at.right + 3.2 * size, low, low + limit, colours.muted, `limit ${short(limit)}`);
  };

  const colourOf = (stops) => {
    const table = new Uint32Array(256);
    for (let i = 0; i < 256; i++) {
      const share = i / 255, k = Math.min(stops.length - 2, stops.findLastIndex(([place]) => place <= share));
      const [a, from] = stops[k], [b, to] = stops[k + 1], t = (share - a) / (b - a);
      const part = (shift) => Math.round(parse(from, shift) * (1 - t) + parse(to, shift) * t);
      table[i] = (255 << 24) | (part(5) << 16) | (part(3) << 8) | part(1);
    }
    return table;
  };
  const parse = (hex, from) => parseInt(hex.slice(from, from + 2), 16);

  const sheet = document.createElement("canvas");

  const carpet = (canvas, { values, places, phases, turn, scale, table }) => {
    const on = begin(canvas);
    if (!on) return null;
    const { ctx, width } = on;
    const at = axes(on, {
      xs: [0, 360], ys: [0, phases], xTitle: "input angle [deg]", yTitle: "input turn", right: 6.8 * size,
      xTicks: width < 500 ? [0, 90, 180, 270, 360] : [0, 60, 120, 180, 240, 300, 360],
    });
    if (sheet.width !== places || sheet.height !== phases) { sheet.width = places; sheet.height = phases; }
    const own = sheet.getContext("2d"), image = own.createImageData(places, phases);
    const pixels = new Uint32Array(image.data.buffer), factor = 255 / (scale[1] - scale[0]);
    for (let p = 0, v = 0; p < phases; p++) {
      for (let j = 0, i = (phases - 1 - p) * places; j < places; j++, v++, i++) {
        pixels[i] = table[Math.max(0, Math.min(255, (values[v] - scale[0]) * factor)) | 0];
      }
    }
    own.putImageData(image, 0, 0);
    ctx.imageSmoothingEnabled = phases > at.bottom - at.top;
    ctx.drawImage(sheet, at.left, at.top, at.right - at.left, at.bottom - at.top);
    const [upper, lower] = [at.y(turn + 1), at.y(turn)];
    ctx.strokeStyle = colours.bad; ctx.lineWidth = 1.5;
    ctx.strokeRect(at.left, upper - 0.5, at.right - at.left, Math.max(2, lower - upper) + 1);
    colourBar(ctx, at, at.right + 1.4 * size, scale, table);
    return at;
  };

  const barSheet = document.createElement("canvas");
  barSheet.width = 1;
  barSheet.height = 256;

  const colourBar = (ctx, at, x, scale, table) => {
    // The unit stands above the bar: below it, it would read on from the last tick of the angle, "360 arcmin".
    const top = at.top + 1.7 * size, height = at.bottom - top;
    if (barSheet.table !== table) {
      const own = barSheet.getContext("2d"), image = own.createImageData(1, 256);
      new Uint32Array(image.data.buffer).set([...table].reverse());
      own.putImageData(image, 0, 0);
      barSheet.table = table;
    }
    words(ctx, "arcmin", x, at.top + 0.5 * size, colours.muted);
    ctx.drawImage(barSheet, x, top, 10, height);
    for (const value of ticks(scale[0], scale[1], height / 40)) {
      words(ctx, short(value), x + 14, at.bottom - ((value - scale[0]) / (scale[1] - scale[0])) * height, colours.muted);
    }
  };

  // Peak-to-peak against one input: the tolerance cloud, the path of this input alone, the present point and the limit.
  const cloud = (canvas, { points, path, now, xs, top, xTitle, limit, reference, histogram, metNow }) => {
    const on = begin(canvas);
    if (!on) return null;
    const { ctx } = on;
    const at = axes(on, { xs, ys: [0, top], xTitle, yTitle: "peak-to-peak [arcmin]", right: histogram ? 48 : 12 });
    if (limit) {
      ctx.fillStyle = colours.good; ctx.globalAlpha = 0.08;
      ctx.fillRect(at.left, at.y(Math.min(limit, top)), at.right - at.left, at.bottom - at.y(Math.min(limit, top)));
      ctx.globalAlpha = 1;
    }
    ctx.save();
    ctx.beginPath(); ctx.rect(at.left, at.top, at.right - at.left, at.bottom - at.top); ctx.clip();
    if (points) ctx.drawImage(scattered(points, at, on, `${xs} ${top} ${colours.cloud}`), 0, 0, on.width, on.height);
    if (path) curve(ctx, at, path.x, path.y, colours.accent, 2);
    ctx.restore();
    if (histogram) sideways(ctx, at, histogram, top);
    if (limit && limit < top) {
      ctx.strokeStyle = colours.bad; ctx.lineWidth = 1.5; ctx.setLineDash([5, 4]);
      line(ctx, [[at.left, at.y(limit)], [at.right, at.y(limit)]]);
      ctx.setLineDash([]);
      words(ctx, `limit ${short(limit)}`, at.right - 6, at.y(limit) + 10, colours.bad, "right");
    }
    if (reference) dot(ctx, at, reference, top, colours.reference, 4.5);
    dot(ctx, at, now, top, metNow === false ? colours.bad : colours.accent, 6);
    return at;
  };

  // The points alone, on a sheet that is drawn anew only when they, the axes or the colours change.
  const pointSheet = document.createElement("canvas");
  const scattered = ({ x, y }, at, { ctx, width, height }, key) => {
    const whole = `${key} ${width} ${height} ${ctx.canvas.width} ${y.length} ${x[0]} ${y[0]} ${y[y.length - 1]}`;
    if (pointSheet.key === whole && pointSheet.column === x) return pointSheet;
    pointSheet.key = whole;
    pointSheet.column = x;
    pointSheet.width = ctx.canvas.width;
    pointSheet.height = ctx.canvas.height;
    const own = pointSheet.getContext("2d");
    own.scale(ctx.canvas.width / width, ctx.canvas.height / height);
    own.fillStyle = colours.cloud;
    for (let i = 0; i < y.length; i++) own.fillRect(at.x(x[i]) - 1, at.y(y[i]) - 1, 2.2, 2.2);
    return pointSheet;
  };

  const dot = (ctx, at, [x, y], top, colour, radius) => {
    ctx.fillStyle = colour; ctx.strokeStyle = colours.paper; ctx.lineWidth = 1.5;
    ctx.beginPath(); ctx.arc(at.x(x), at.y(Math.min(y, top)), radius, 0, 2 * Math.PI); ctx.fill(); ctx.stroke();
  };

  const sideways = (ctx, at, counts, top) => {
    const most = Math.max(...counts, 1), step = top / counts.length;
    ctx.fillStyle = colours.cloud;
    counts.forEach((count, i) => {
      const upper = at.y((i + 1) * step);
      ctx.fillRect(at.right + 4, upper, (count / most) * 40, at.y(i * step) - upper - 0.5);
    });
  };

  const orders = (canvas, { rows, top }) => {
    const on = begin(canvas);
    if (!on) return;
    const { ctx, height } = on;
    const fitting = Math.max(4, Math.floor((height - 44) / (size + 2)));
    const shown = rows.slice(0, fitting);
    const at = axes(on, {
      xs: [0, top], ys: [shown.length - 0.4, -0.6], xTitle: "amplitude [arcmin]", yNames: shown.map((row) => row.symbol),
    });
    const bar = Math.min(16, (0.62 * (at.bottom - at.top)) / shown.length);
    shown.forEach((row, i) => {
      ctx.fillStyle = colours.accent;
      ctx.fillRect(at.left + 1, at.y(i) - bar / 2, Math.max(0, at.x(row.amplitude) - at.left - 1), bar);
      if (row.reference === undefined) return;
      ctx.fillStyle = colours.reference;
      ctx.fillRect(at.x(row.reference) - 1, at.y(i) - bar / 2 - 1, 2.5, bar + 2);
    });
  };

  // One curve over a quarter of the ring, filled above zero; or the sentence that says why there is none.
  const quarter = (canvas, { why, values, yTitle, mark, level, levelName, fill }) => {
    const on = begin(canvas);
    if (!on) return;
    const { ctx, width, height } = on;
    if (why) {
      words(ctx, why, width / 2, height / 2, colours.muted, "center");
      return;
    }
    const xs = values.map((_, i) => (90 * i) / (values.length - 1));
    let low = Math.min(0, ...values), high = Math.max(0, level || 0, ...values);
    const pad = 0.06 * (high - low);
    low -= low < 0 ? pad : 0; high += pad;
    const at = axes(on, { xs: [0, 90], ys: [low, high], xTitle: "from the major axis [deg]", yTitle, xTicks: [0, 30, 60, 90] });
    if (fill) {
      ctx.fillStyle = colours.band;
      ctx.beginPath();
      ctx.moveTo(at.x(0), at.y(0));
      xs.forEach((x, i) => ctx.lineTo(at.x(x), at.y(Math.max(0, values[i]))));
      ctx.lineTo(at.x(90), at.y(0));
      ctx.fill();
    }
    ctx.strokeStyle = colours.axis; ctx.lineWidth = 1;
    line(ctx, [[at.left, at.y(0)], [at.right, at.y(0)]]);
    curve(ctx, at, xs, values, colours.accent);
    if (level) {
      ctx.strokeStyle = colours.bad; ctx.setLineDash([5, 4]);
      line(ctx, [[at.left, at.y(level)], [at.right, at.y(level)]]);
      ctx.setLineDash([]);
      words(ctx, levelName, at.right - 4, at.y(level) + 9, colours.bad, "right");
    }
    if (mark) {
      ctx.strokeStyle = colours.ink; ctx.setLineDash([2, 3]);
      line(ctx, [[at.x(mark), at.top], [at.x(mark), at.bottom]]);
      ctx.setLineDash([]);
      words(ctx, `${short(mark)}°`, at.x(mark) + 5, at.top + 8, colours.ink);
    }
  };

  return { readTheme, short, shareOf, waveform, carpet, cloud, orders, quarter, colourOf };
})();
