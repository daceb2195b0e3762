// ---- what stands around the picture

function text(value) { return (Math.abs(value) >= 1e4 || (value !== 0 && Math.abs(value) < 1e-2) ? value.toExponential(2) : String(+value.toPrecision(4))).replace("-", "\u2212"); }

function prefixed(value, unit) { // factor and unit in which a value reads well
  if (!unit || unit[0] === "1" || !value) return [1, unit || ""];
  const power = Math.max(-12, Math.min(9, 3 * Math.floor(Math.log10(Math.abs(value) * 1.0001) / 3)));
  return [10 ** -power, { "-12": "p", "-9": "n", "-6": "\u00b5", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" }[power] + unit];
}

function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find((step) => step * power <= value * 1.0000001) * power;
}

function showScale() {
  $("scale").hidden = state.colour < 0;
  if (state.colour < 0) return;
  const value = head.values[state.colour], map = head.maps[value.map], paint = $("bar").getContext("2d");
  for (let k = 0; k < 64; ++k) {
    const rgb = map.slice(3 * k, 3 * k + 3);
    buffers.colours.set([...rgb, 255], 8 * k + 4);
    paint.fillStyle = `rgb(${rgb})`;
    paint.fillRect(0, 252 - 4 * k, 1, 4);
  }
  gl.activeTexture(gl.TEXTURE1);
  gl.bindTexture(gl.TEXTURE_2D, buffers.palette);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2, buffers.colours.length / 8, gl.RGBA, gl.UNSIGNED_BYTE, buffers.colours);
  const [factor, unit] = prefixed(Math.max(Math.abs(value.low), Math.abs(value.high)), value.unit);
  $("unit").textContent = unit ? `${value.title} [${unit}]` : value.title;
  $("ticks").replaceChildren(...[1, 0.75, 0.5, 0.25, 0].map((share) => {
    const tick = document.createElement("span");
    tick.textContent = text(factor * (value.low + share * (value.high - value.low)));
    return tick;
  }));
}

function showRuler() {
  const seen = camera(), length = nice(0.2 * targets.wide / seen.pixels), [factor, unit] = prefixed(length, "m");
  $("ruler").firstElementChild.textContent = `${+(length * factor).toPrecision(3)} ${unit}`;
  $("ruler").lastElementChild.style.width = `${length * seen.pixels / targets.ratio}px`;
  const pen = $("axes").getContext("2d");
  pen.clearRect(0, 0, 180, 180);
  pen.lineWidth = 5;
  pen.font = "26px sans-serif";
  const order = [0, 1, 2].slice(0, head.dimension).sort((a, b) => seen.rows[2][a] - seen.rows[2][b]);
  for (const axis of order) {
    pen.strokeStyle = pen.fillStyle = ["#c83c32", "#288c46", "#325ac8"][axis];
    const [x, y] = [seen.rows[0][axis], -seen.rows[1][axis]];
    pen.beginPath(); pen.moveTo(90, 90); pen.lineTo(90 + 60 * x, 90 + 60 * y); pen.stroke();
    pen.fillText("xyz"[axis], 82 + 78 * x, 98 + 78 * y);
  }
}

function showPicked() {
  const b = state.picked;
  if (b < 0) { $("picked").textContent = "Click a body."; return; }
  const at = 2 * (state.frame * head.bodies.length + b), lines = [`Body ${head.bodies[b]}`], centre = middle(b);
  const [f, u] = prefixed(box.size, "m");
  lines.push(`centre ${centre.slice(0, head.dimension).map((x) => text(f * x)).join(", ")} ${u}`);
  for (const [k, name] of [[0, "mean pressure"], [1, "von Mises of the mean stress"]]) {
    const value = arrays.stress[at + k], [factor, unit] = prefixed(value, "Pa");
    if (Number.isFinite(value)) lines.push(`${name} ${text(factor * value)} ${unit}`);
  }
  const now = contactsNow();
  if (now) {
    const mine = [];
    for (let k = 0; k < now.pairs.length / 2; ++k) {
      const [one, two] = now.pairs.subarray(2 * k, 2 * k + 2);
      if (one === b || two === b) mine.push([head.bodies[one === b ? two : one], Math.hypot(...now.rows.subarray(6 * k + 3, 6 * k + 6))]);
    }
    mine.sort((p, q) => q[1] - p[1]);
    lines.push(`${mine.length} contact${mine.length === 1 ? "" : "s"}${mine.length ? ":" : ""}`);
    for (const [body, force] of mine.slice(0, 12)) {
      const [factor, unit] = prefixed(force, flat ? "N/m" : "N");
      lines.push(`  with ${body}: ${text(factor * force)} ${unit}`);
    }
  }
  $("picked").textContent = lines.join("\n");
}

function showHistory() {
  const time = head.history.time, column = $("column").value, pen = $("history").getContext("2d"), [w, h] = [552, 300];
  if (!time || !column) return;
  const values = head.history[column], known = values.filter((v) => v !== null);
  let low = Math.min(...known), high = Math.max(...known);
  if (!(high > low)) { low -= Math.abs(low) || 1; high += Math.abs(high) || 1; }
  const end = Math.max(...time) || 1, x = (t) => 90 + (w - 110) * t / end, y = (v) => h - 50 - (h - 70) * (v - low) / (high - low);
  pen.clearRect(0, 0, w, h);
  pen.strokeStyle = "#bbb";
  pen.lineWidth = 2;
  pen.strokeRect(90, 20, w - 110, h - 70);
  pen.fillStyle = "#222";
  pen.font = "20px sans-serif";
  pen.textAlign = "right";
  for (const v of [low, (low + high) / 2, high]) pen.fillText(text(v), 84, y(v) + 7);
  pen.textAlign = "center";
  for (const t of [0, end / 2, end]) pen.fillText(text(t), Math.min(x(t), w - pen.measureText(text(t)).width / 2 - 2), h - 26);
  pen.fillText("time [s]", 90 + (w - 110) / 2, h - 4);
  pen.strokeStyle = "#1b6ca8";
  pen.lineWidth = 3;
  pen.beginPath();
  time.forEach((t, k) => { if (values[k] !== null) pen.lineTo(x(t), y(values[k])); });
  pen.stroke();
  pen.strokeStyle = "#b01414";
  pen.beginPath();
  pen.moveTo(x(head.frames[state.frame].time), 20);
  pen.lineTo(x(head.frames[state.frame].time), h - 50);
  pen.stroke();
}

function showWhen() {
  const frame = head.frames[state.frame], full = head.full.includes(state.frame);
  $("when").textContent = `${frame.label}  (step ${frame.step})`;
  $("frame").value = state.frame;
  const notes = [];
  if (head.step > 1) notes.push(`one of ${head.step} points is shown`);
  if (!full) notes.push("places within bodies and values are interpolated between stored outputs");
  $("note").textContent = notes.join("; ");
}

// ---- what a user does

function update() { dirty = true; }

function set(changes) {
  Object.assign(state, changes);
  state.frame = Math.max(0, Math.min(head.frames.length - 1, state.frame));
  state.elevation = Math.max(-89, Math.min(89, state.elevation));
  state.zoom = Math.max(0.2, Math.min(200, state.zoom));
  state.cut = Math.max(0, Math.min(1, state.cut));
  $("colour").value = state.colour;
  $("axis").value = state.axis < 0 ? "" : state.axis;
  $("cut").value = Math.round(1000 * state.cut);
  $("flip").checked = state.flip;
  $("contacts").checked = state.contacts;
  $("play").textContent = state.playing ? "\u23f8" : "\u25b6";
  $("play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
  update();
}

function reset() { set({ azimuth: 35, elevation: 22, zoom: 1, pan: [0, 0] }); }

function turn(dx, dy) {
  if (flat) move(dx, dy); else set({ azimuth: state.azimuth - 0.4 * dx, elevation: state.elevation + 0.4 * dy });
}

function move(dx, dy) {
  const per = camera().pixels / targets.ratio;
  set({ pan: [state.pan[0] - dx / per, state.pan[1] + dy / per] });
}

function pick(index) { set({ picked: index }); }

const KEYS = {
  ArrowLeft: () => turn(-20, 0), ArrowRight: () => turn(20, 0), ArrowUp: () => turn(0, -20), ArrowDown: () => turn(0, 20),
  "+": () => set({ zoom: state.zoom * 1.15 }), "=": () => set({ zoom: state.zoom * 1.15 }), "-": () => set({ zoom: state.zoom / 1.15 }),
  " ": () => set({ playing: !state.playing }), ",": () => set({ frame: state.frame - 1 }), ".": () => set({ frame: state.frame + 1 }),
  f: () => { set({ colour: state.colour + 1 < head.values.length ? state.colour + 1 : -1 }); showScale(); },
  c: () => { if (!flat) set({ axis: state.axis < 2 ? state.axis + 1 : -1 }); }, x: () => set({ flip: !state.flip }),
  "[": () => set({ cut: state.cut - 0.02 }), "]": () => set({ cut: state.cut + 0.02 }), k: () => set({ contacts: !state.contacts }),
  n: () => pick((state.picked + 1) % head.bodies.length), p: () => pick((state.picked - 1 + head.bodies.length) % head.bodies.length), r: reset,
};

function listen() {
  const canvas = $("scene"), fingers = new Map();
  let moved = 0, apart = 0;
  canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, e); moved = 0; apart = 0; canvas.focus(); });
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const [dx, dy] = [e.clientX - before.clientX, e.clientY - before.clientY];
    fingers.set(e.pointerId, e);
    moved += Math.abs(dx) + Math.abs(dy);
    if (fingers.size === 2) {
      const [a, b] = [...fingers.values()], now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
      if (apart > 0 && now > 0) set({ zoom: state.zoom * now / apart });
      apart = now;
      move(dx / 2, dy / 2);
    } else if (e.shiftKey || e.buttons === 2) move(dx, dy);
    else turn(dx, dy);
  });
  const up = (e) => {
    if (fingers.size === 1 && moved < 5 && e.type === "pointerup") {
      const at = canvas.getBoundingClientRect();
      pick(pickAt(e.clientX - at.left, e.clientY - at.top));
    }
    fingers.delete(e.pointerId);
    apart = 0;
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); set({ zoom: state.zoom * Math.exp(-0.0015 * e.deltaY) }); }, { passive: false });
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.altKey || e.metaKey || ["SELECT", "INPUT"].includes(e.target.tagName) || (e.target.tagName === "BUTTON" && e.key === " ")) return;
    if (KEYS[e.key]) { e.preventDefault(); KEYS[e.key](); }
  });
  $("colour").addEventListener("change", (e) => { set({ colour: +e.target.value }); showScale(); });
  $("axis").addEventListener("change", (e) => set({ axis: e.target.value === "" ? -1 : +e.target.value }));
  $("cut").addEventListener("input", (e) => set({ cut: e.target.value / 1000 }));
  $("flip").addEventListener("change", (e) => set({ flip: e.target.checked }));
  $("contacts").addEventListener("change", (e) => set({ contacts: e.target.checked }));
  $("frame").addEventListener("input", (e) => set({ frame: +e.target.value }));
  $("play").addEventListener("click", () => set({ playing: !state.playing }));
  $("reset").addEventListener("click", reset);
  $("column").addEventListener("change", update);
  new ResizeObserver(update).observe(canvas);
}

function fill() {
  document.title = head.title;
  $("title").textContent = head.title;
  $("title").classList.toggle("failed", head.failed);
  const option = (value, words) => { const made = document.createElement("option"); made.value = value; made.textContent = words; return made; };
  $("colour").append(option(-1, "bodies"), ...head.values.map((v, k) => option(k, v.title)));
  $("axis").append(...["x", "y", "z"].map((name, k) => option(k, `across ${name}`)));
  $("cutting").hidden = flat;
  $("chains").hidden = !head.frames.some((_, k) => arrays["pairs_" + k]);
  $("frame").max = head.frames.length - 1;
  const columns = Object.keys(head.history).filter((name) => name !== "time");
  $("past").hidden = !columns.length;
  $("column").append(...columns.map((name) => option(name, name.replaceAll("_", " ") + (head.units[name] ? ` [${head.units[name]}]` : ""))));
}

let last = 0, before = 0, moving = 0;
function tick(now) {
  if (state.playing && now - last > 80) { last = now; set({ frame: (state.frame + 1) % head.frames.length }); }
  if (dirty) {
    dirty = false;
    if (++moving > 2 && now - before > 100) quality = 0.5;
    draw(); showRuler(); showWhen(); showPicked(); showHistory();
  } else if (moving) {
    moving = 0;
    if (quality < 1) { quality = 1; dirty = true; }
  }
  before = now;
  requestAnimationFrame(tick);
}

// What a test asks: frames a second, drawn one after the other and waited for.
function speed(count) {
  const pixel = new Uint8Array(4), start = performance.now();
  for (let k = 0; k < count; ++k) {
    state.azimuth += 3;
    draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  }
  update();
  return count / (performance.now() - start) * 1000;
}

unpack().then(() => { prepare(); fill(); listen(); set({ frame: head.frames.length - 1 }); showScale(); requestAnimationFrame(tick); window.ready = true; })
  .catch((error) => { $("note").textContent = `This page cannot be shown: ${error.message}`; console.error(error); });
