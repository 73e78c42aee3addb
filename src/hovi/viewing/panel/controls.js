// The bar below the scene and the panel beside it, both in step with the animation.

function element(kind, attributes = {}, ...children) {
    const made = document.createElement(kind);
    for (const [name, value] of Object.entries(attributes)) {
        if (name === "text") { made.textContent = value; } else { made.setAttribute(name, value); }
    }
    made.append(...children);
    return made;
}

function drawing(kind, attributes = {}) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
    for (const [name, value] of Object.entries(attributes)) { made.setAttribute(name, value); }
    return made;
}

function short(x) {
    const size = Math.abs(x);
    if (size !== 0 && (size < 1e-3 || size >= 1e5)) { return x.toExponential(1); }
    return x.toFixed(size >= 100 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3);
}

const ICONS = { play: "M1 0 L13 7 L1 14 Z", pause: "M1 0 H5 V14 H1 Z M9 0 H13 V14 H9 Z" };

class Controls {
    constructor(viewer, panel, stage) {
        this.viewer = viewer;
        this.panel = panel;
        this.stage = stage;
        this.t = 0;
        this.alone = null;
        this.bar();
        if (panel.names.length === 0) {
            document.body.classList.add("alone");
        } else {
            this.meters();
            this.strips = [
                this.strip("torque", panel.tau, panel.limits.tau),
                this.strip("velocity", panel.v, panel.limits.v),
            ];
        }
        this.captions();
        this.follow();
        this.show(0);
        const step = () => { this.frame(); requestAnimationFrame(step); };
        requestAnimationFrame(step);
    }

    get animator() { return this.viewer.animator; }

    // What plays is meshcat's animator; a message with a new motion starts it at once.
    follow() {
        const load = this.animator.load.bind(this.animator);
        this.animator.load = (animations, options) => {
            load(animations, options);
            this.animator.mixer.timeScale = Number(this.speed.value);
            this.repeat(!Number.isFinite(options.repetitions ?? 1));
        };
        const set = this.viewer.set_property.bind(this.viewer);
        this.viewer.set_property = (path, name, value) => {
            if (path[0] !== "hovi") { return set(path, name, value); }
            this.animator.pause(); // Python moves the robot
            this.animator.display_progress(value);
            this.show(value);
        };
    }

    bar() {
        const panel = this.panel, bar = document.getElementById("bar");
        this.play = element("button", { id: "play", "aria-label": "play" }, drawing("svg", { viewBox: "0 0 14 14" }));
        this.play.firstChild.append(drawing("path", { d: ICONS.play }));
        this.time = element("input", {
            id: "time", type: "range", min: 0, max: panel.duration, step: "any", value: 0,
            "aria-label": "time in seconds",
        });
        this.clock = element("span", { id: "clock" });
        this.speed = element("select", { id: "speed", "aria-label": "speed" });
        const speeds = [...new Set([0.1, 0.25, 0.5, 1, 2, 4, panel.speed])].sort((a, b) => a - b);
        for (const x of speeds) {
            this.speed.append(element("option", { value: x, text: `${x}×` }));
        }
        this.speed.value = panel.speed;
        this.chips = element("div", { id: "chips" });
        this.chips.append(this.speed);
        bar.append(this.play, this.time, this.clock, this.chips);
        this.play.onclick = () => this.toggle();
        this.time.oninput = () => this.seek(Number(this.time.value));
        this.speed.onchange = () => { this.animator.mixer.timeScale = Number(this.speed.value); };
        this.loop = this.chip("Loop", on => this.repeat(on));
        if (panel.trace) { this.chip("Path", on => this.visible("trace", on), true); }
        if (panel.joints.length > 0) {
            this.chip("Ends", on => { this.viewer.set_property(["Ends"], "visible", on); this.viewer.set_dirty(); }, true);
            this.chip("Names", on => this.marked("names", on));
            this.chip("Frames", on => this.marked("frames", on));
        }
        if (panel.joints.some(joint => joint.axis !== null)) {
            this.chip("Arcs", on => this.marked("arcs", on));
        }
        this.chip("Scene", on => { this.viewer.gui.domElement.style.display = on ? "" : "none"; });
        document.addEventListener("keydown", event => this.key(event));
    }

    chip(name, change, on = false) {
        const made = element("button", { text: name, "aria-pressed": on, id: `chip-${name.toLowerCase()}` });
        made.onclick = () => {
            const pressed = made.getAttribute("aria-pressed") !== "true";
            made.setAttribute("aria-pressed", pressed);
            change(pressed);
        };
        this.chips.append(made);
        return made;
    }

    key(event) {
        if (["INPUT", "SELECT", "BUTTON"].includes(event.target.tagName) && event.key !== "Escape") { return; }
        const by = this.panel.duration / 50;
        if (event.key === " ") { this.toggle(); event.preventDefault(); }
        if (event.key === "ArrowLeft") { this.seek(Math.max(this.t - by, 0)); }
        if (event.key === "ArrowRight") { this.seek(Math.min(this.t + by, this.panel.duration)); }
    }

    marked(what, on) {
        this.stage.show(what, on);
        this.stage.update(this.t, i => this.value(this.panel.q, i));
    }

    visible(path, on) {
        this.viewer.set_property(["meshcat", path], "visible", on);
        this.viewer.set_dirty();
    }

    repeat(on) {
        const { LoopRepeat } = MeshCat.THREE;
        for (const action of this.animator.actions) { action.setLoop(LoopRepeat, on ? Infinity : 1); }
        this.loop.setAttribute("aria-pressed", on);
    }

    toggle() {
        if (this.animator.playing) { this.animator.pause(); return; }
        const from = this.t >= this.panel.duration * (1 - 1e-9) ? 0 : this.t;
        this.seek(from);
        this.animator.play();
    }

    seek(t) {
        this.animator.pause();
        for (const action of this.animator.actions) { action.reset(); action.play(); }
        this.animator.seek(t);
        this.animator.display_progress(t);
        this.show(t);
    }

    frame() {
        const playing = this.animator.playing;
        if (playing !== this.playing) {
            this.playing = playing;
            this.play.firstChild.firstChild.setAttribute("d", playing ? ICONS.pause : ICONS.play);
            this.play.setAttribute("aria-label", playing ? "pause" : "play");
        }
        if (this.animator.time !== this.t) { this.show(this.animator.time); }
        else if (this.stage.shown.names) { this.stage.place(this.t); }
    }

    // Everything that depends on the time, for a time in seconds.
    show(t) {
        this.t = t;
        this.time.value = t;
        this.clock.textContent = `${t.toFixed(2)} / ${short(this.panel.duration)} s`;
        this.stage.update(t, i => this.value(this.panel.q, i));
        if (this.strips === undefined) { return; }
        for (const { cursor } of this.strips) {
            cursor.style.left = `calc(46px + (100% - 46px) * ${t / this.panel.duration})`;
        }
        this.rows.forEach((row, i) => row(this.value(this.panel.q, i), this.value(this.panel.tau, i)));
        this.viewer.set_dirty();
    }

    value(curves, i) {
        const y = curves[i], M = y.length - 1;
        const x = Math.min(Math.max(this.t / this.panel.duration, 0), 1) * M;
        const k = Math.min(Math.floor(x), M - 1);
        return y[k] + (x - k) * (y[k + 1] - y[k]);
    }

    captions() {
        const motions = document.getElementById("motions");
        for (const { label, color } of this.panel.motions) {
            const dot = element("i");
            dot.style.background = color;
            motions.append(element("span", { class: "motion label" }, dot, label));
        }
    }

    // One row for each coordinate: where it is in its range, and its torque.
    meters() {
        const panel = this.panel, side = document.getElementById("side");
        const table = element("div", { id: "joints" });
        side.append(element("h2", { text: panel.heading }), table);
        table.append(
            element("span", { class: "head", text: "joint" }),
            element("span", { class: "head wide", text: "position [deg, m]" }),
            element("span", { class: "head wide", text: "torque [N m, N]" }),
        );
        const suffix = "_joint";
        const all = panel.names.every(name => name.endsWith(suffix) && name.length > suffix.length);
        const brief = name => all ? name.slice(0, -suffix.length) : name;
        this.rows = panel.names.map((name, i) => {
            const sample = drawing("svg", { class: "sample", viewBox: "0 0 20 10" });
            sample.append(drawing("path", { d: "M0 5 H20", ...this.style(i, 1.4) }));
            const label = element("span", { class: "joint label", title: name }, sample, element("span", { text: brief(name) }));
            label.onclick = () => this.only(i);
            const rounding = 1e-9 * Math.max(...panel.tau[i].map(Math.abs));
            const scale = panel.angular[i] ? 180 / Math.PI : 1;
            const [q, tau] = [
                this.meter(panel.q[i], panel.limits.q[i], true),
                this.meter(panel.tau[i], panel.limits.tau[i], false),
            ];
            const [angle, torque] = [element("span", { class: "number" }), element("span", { class: "number" })];
            table.append(label, q.made, angle, tau.made, torque);
            return (x, y) => {
                q.set(x);
                tau.set(y);
                angle.textContent = (scale * x).toFixed(scale > 1 ? 1 : 3).replace(/^-(0\.0+)$/, "$1");
                torque.textContent = short(Math.abs(y) > rounding ? y : 0);
            };
        });
    }

    // A bar between limits; between the extremes of the motion, hatched, where there are none.
    meter(curve, limits, point) {
        const bounded = limits[0] !== null && limits[1] !== null;
        const reach = Math.max(...curve.map(Math.abs), 1e-9);
        const low = bounded ? limits[0] : point ? Math.min(...curve) : -reach;
        const high = bounded ? limits[1] : point ? Math.max(...curve) : reach;
        const range = Math.max(high - low, 1e-9), fill = element("i");
        const made = element("div", { class: `meter${bounded ? "" : " free"}${point ? " point" : ""}` }, fill);
        made.title = bounded ? `${short(low)} to ${short(high)}` : "without limits";
        const share = x => Math.min(Math.max((x - low) / range, 0), 1);
        const set = x => {
            if (point) { fill.style.left = `${100 * share(x)}%`; } else {
                const [from, to] = [share(0), share(x)];
                fill.style.left = `${100 * Math.min(from, to)}%`;
                fill.style.width = `${100 * Math.abs(to - from)}%`;
            }
            made.classList.toggle("at", bounded && Math.min(x - low, high - x) < 2e-3 * range);
        };
        return { made, set };
    }

    strip(kind, curves, limits) {
        const panel = this.panel, W = 1000, H = 104;
        const units = { torque: "N m", velocity: "rad/s" }, linear = { torque: "N", velocity: "m/s" };
        const both = panel.angular.every(x => x) ? units[kind]
            : panel.angular.some(x => x) ? `${units[kind]}, ${linear[kind]}` : linear[kind];
        const all = [curves, ...panel.others.map(other => other[kind === "torque" ? "tau" : "v"])];
        let low = Math.min(0, ...all.flat().map(y => Math.min(...y)));
        let high = Math.max(0, ...all.flat().map(y => Math.max(...y)));
        const extent = Math.max(high - low, 1e-9);
        const near = limits.map(each => each.map(y => y !== null && y > low - 0.25 * extent && y < high + 0.25 * extent ? y : null));
        for (const y of near.flat()) { if (y !== null) { low = Math.min(low, y); high = Math.max(high, y); } }
        const span = Math.max(high - low, 1e-9);
        const Y = y => (4 + (H - 8) * (high - y) / span).toFixed(1);
        const svg = drawing("svg", { viewBox: `0 0 ${W} ${H}`, preserveAspectRatio: "none" });
        const add = (d, attributes) => svg.append(drawing("path", { d, ...attributes }));
        add(`M0 ${Y(0)} H${W}`, { class: "zero" });
        const joints = new Map();  // of each limit
        near.forEach((each, i) => each.forEach(y => { if (y !== null) { joints.set(y, [...joints.get(y) ?? [], i]); } }));
        for (const [y, those] of joints) {
            const shared = those.length === curves.length;  // else the dashes have the colors of the joints, in turn
            (shared ? [null] : those).forEach((i, k) => add(`M0 ${Y(y)} H${W}`, i === null ? { class: "limit" } : {
                class: "limit", "data-joint": i,
                style: `stroke: ${panel.colors[i]}; stroke-dasharray: 7 ${11 * those.length - 7}; stroke-dashoffset: ${-11 * k}`,
            }));
        }
        all.forEach((set, k) => set.forEach((y, i) => {
            const length = k === 0 ? 1 : panel.others[k - 1].duration / panel.duration;
            const points = y.map((value, j) => `${(W * length * j / (y.length - 1)).toFixed(1)} ${Y(value)}`);
            const style = k === 0 ? this.style(i, 1.6) : { stroke: panel.colors[i] };
            add(`M${points.join("L")}`, { class: k === 0 ? "curve" : "curve other", ...style, "data-joint": i });
        }));
        svg.append(drawing("rect", { x: 0, y: 0, width: W, height: H }));
        const cursor = element("div", { class: "cursor" });
        const strip = element("div", { class: "strip", id: kind },
            svg, cursor,
            element("span", { class: "label top", text: short(high) }),
            element("span", { class: "label bottom", text: short(low) }),
            element("span", { class: "label from", text: "0" }),
            element("span", { class: "label to", text: `${short(panel.duration)} s` }));
        const seek = event => {
            const box = svg.getBoundingClientRect();
            this.seek(panel.duration * Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1));
        };
        strip.onpointerdown = event => { strip.setPointerCapture(event.pointerId); seek(event); };
        strip.onpointermove = event => { if (event.buttons) { seek(event); } };
        document.getElementById("side").append(element("h2", { text: `${kind[0].toUpperCase()}${kind.slice(1)} [${both}]` }), strip);
        return { cursor, svg };
    }

    // The color of a joint, and its dashes where there are more joints than colors.
    style(i, width) {
        const dashes = this.panel.dashes[i].map(length => length * width);
        return { stroke: this.panel.colors[i], ...dashes.length > 0 ? { "stroke-dasharray": dashes.join(" ") } : {} };
    }

    // Fade the curves of all joints but one; again for all.
    only(i) {
        this.alone = this.alone === i ? null : i;
        document.querySelectorAll(".strip [data-joint]").forEach(path => {
            path.classList.toggle("faded", this.alone !== null && Number(path.dataset.joint) !== this.alone);
        });
        document.querySelectorAll(".joint").forEach((label, k) => {
            label.classList.toggle("faded", this.alone !== null && k !== this.alone);
        });
    }
}

// meshcat merges the parts of a Collada file; a part with several materials gets a list where one
// material is expected, and is hidden (the UR5's shoulder, for instance).
const drawObject = MeshCat.Viewer.prototype.set_object;
MeshCat.Viewer.prototype.set_object = function (path, object) {
    if (Array.isArray(object.material)) {
        object.material = object.material.map(m => Array.isArray(m) ? m[0] : m);
    }
    if (object.isPoints) { object.castShadow = false; }
    if (path.some(part => part.startsWith("ghost")) && object.material) {
        object.castShadow = false;
        Object.assign(object.material, { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 4 });
    }
    return drawObject.call(this, path, object);
};
var viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
var stage = new Stage(viewer, PANEL);
viewer.set_3d_pane_size = () => stage.resize();
window.onload = () => stage.resize();
var controls = new Controls(viewer, PANEL, stage);
