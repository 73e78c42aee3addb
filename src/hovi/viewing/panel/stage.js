// The scene around the robot: floor, light, shadows, a camera that fits any window, and the
// names, frames and arcs of joints.

class Stage {
    constructor(viewer, panel) {
        this.viewer = viewer;
        this.panel = panel;
        this.THREE = MeshCat.THREE;
        this.pane = document.getElementById("meshcat-pane");
        this.names = document.getElementById("names");
        this.shown = { names: false, frames: false, arcs: false };
        this.turned = false;
        this.light();
        this.floor();
        this.marks();
        this.ends();
        this.labels();
        this.resize();
        new ResizeObserver(() => this.resize()).observe(this.pane);
        viewer.controls.addEventListener("start", () => { this.turned = true; });
        this.pane.addEventListener("dblclick", () => { this.turned = false; this.look(); });
        viewer.gui.domElement.style.display = "none";
        viewer.gui.__folders["Scene"].close();
    }

    node(path) { return this.viewer.scene_tree.find(path).object; }

    light() {
        const T = this.THREE, size = this.panel.size;
        for (const name of ["SpotLight", "PointLightNegativeX", "PointLightPositiveX", "FillLight"]) {
            this.node(["Lights", name]).visible = false;
        }
        this.node(["Lights", "AmbientLight", "<object>"]).intensity = 0.3;
        const group = this.node(["Stage"]);
        const sky = new T.HemisphereLight(0xffffff, 0xb8c2ce, 0.36);
        sky.position.set(0, 0, 1);
        const sun = new T.DirectionalLight(0xffffff, 0.42);
        sun.position.set(0.55 * size, -0.75 * size, 1.6 * size);
        sun.castShadow = true;
        sun.shadow.mapSize.set(1024, 1024);
        sun.shadow.radius = 5;
        sun.shadow.bias = -0.0008;
        sun.shadow.normalBias = 0.004 * size;
        const eye = sun.shadow.camera;
        [eye.left, eye.right, eye.bottom, eye.top] = [-size, size, -size, size];
        [eye.near, eye.far] = [0.05 * size, 5 * size];
        group.add(sky, sun);
        this.node(["Grid"]).visible = false;
        this.node(["Axes"]).visible = false;
        this.viewer.set_property(["Background"], "top_color", [0.93, 0.95, 0.97]);
        this.viewer.set_property(["Background"], "bottom_color", [1, 1, 1]);
    }

    // A disc that fades into the background, with lines a round number of metres apart.
    floor() {
        const T = this.THREE, size = this.panel.size, radius = 3 * size;
        const canvas = document.createElement("canvas");
        canvas.width = canvas.height = 256;
        const ink = canvas.getContext("2d");
        const fade = ink.createRadialGradient(128, 128, 30, 128, 128, 128);
        fade.addColorStop(0, "#fff");
        fade.addColorStop(1, "#000");
        ink.fillStyle = fade;
        ink.fillRect(0, 0, 256, 256);
        const alphaMap = new T.CanvasTexture(canvas);
        const disc = new T.Mesh(
            new T.PlaneGeometry(2 * radius, 2 * radius),
            new T.MeshLambertMaterial({ color: 0xe6ebf0, alphaMap, transparent: true }),
        );
        disc.receiveShadow = true;
        disc.position.z = -2e-3 * size;
        const spacing = 10 ** Math.round(Math.log10(size / 6));
        const points = [], count = Math.floor(radius / spacing);
        for (let i = -count; i <= count; i++) {
            const at = i * spacing, half = Math.sqrt(Math.max(radius ** 2 - at ** 2, 0)) * 0.6;
            points.push(at, -half, 0, at, half, 0, -half, at, 0, half, at, 0);
        }
        const geometry = new T.BufferGeometry();
        geometry.setAttribute("position", new T.Float32BufferAttribute(points, 3));
        const lines = new T.LineSegments(geometry, new T.LineBasicMaterial({
            color: 0x93a1b0, transparent: true, opacity: 0.22,
        }));
        const floor = this.node(["Floor"]);
        floor.position.set(...this.panel.floor);
        floor.add(disc, lines);
    }

    // Axes of joints and arcs of their ranges; they move with the joints.
    marks() {
        const T = this.THREE, radius = this.panel.mark, group = this.node(["Marks"]);
        group.position.set(...this.panel.shift);
        this.frames = [];
        for (const joint of this.panel.joints) {
            const frame = new T.AxesHelper(radius);
            frame.visible = false;
            frame.material.depthTest = false;
            group.add(frame);
            const arc = joint.axis === null ? null : this.arc(joint, radius);
            if (arc !== null) { group.add(arc.whole); }
            this.frames.push({ joint, frame, arc });
        }
    }

    // Frames of the tips at the start and at the goal, with their names.
    ends() {
        const size = this.panel.size, group = this.node(["Ends"]);
        group.position.set(...this.panel.shift);
        for (const tip of this.panel.joints.filter(joint => joint.tip)) {
            const first = tip.at[0], last = tip.at[tip.at.length - 1];
            const apart = Math.max(...first.map((x, i) => Math.abs(x - last[i]))) > 1e-3 * size;
            group.add(this.end(first, apart ? "start" : "start and goal", 0x1d2733));
            if (apart) { group.add(this.end(last, "goal", 0x003f73)); }
        }
    }

    // A frame of three bars, red, green and blue, at a pose, and a name that always faces the camera.
    end(pose, name, color) {
        const T = this.THREE, size = this.panel.size, length = 0.1 * size, frame = new T.Group();
        frame.position.set(pose[0], pose[1], pose[2]);
        frame.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
        const solid = (geometry, paint) => {
            const made = new T.Mesh(geometry, new T.MeshBasicMaterial({ color: paint }));
            frame.add(made);
            return made;
        };
        [0xc8372d, 0x2e8b3d, 0x2f5fc4].forEach((paint, k) => {
            const bar = solid(new T.CylinderGeometry(0.005 * size, 0.005 * size, length, 8), paint);
            bar.position.setComponent(k, 0.5 * length);
            if (k === 0) { bar.rotation.z = -Math.PI / 2; }
            if (k === 2) { bar.rotation.x = Math.PI / 2; }
        });
        solid(new T.SphereGeometry(0.012 * size, 12, 8), color);
        const whole = new T.Group(), label = this.text(name, color);
        label.position.set(pose[0], pose[1], pose[2]);
        whole.add(frame, label);
        return whole;
    }

    text(words, color) {
        const T = this.THREE, canvas = document.createElement("canvas"), ink = canvas.getContext("2d");
        const font = "600 44px system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";
        ink.font = font;
        [canvas.width, canvas.height] = [Math.ceil(ink.measureText(words).width) + 24, 64];
        ink.font = font;
        [ink.lineWidth, ink.lineJoin, ink.textBaseline, ink.strokeStyle] = [6, "round", "middle", "#fff"];
        ink.strokeText(words, 12, 32);
        ink.fillStyle = `#${color.toString(16).padStart(6, "0")}`;
        ink.fillText(words, 12, 32);
        const map = new T.CanvasTexture(canvas);
        const sprite = new T.Sprite(new T.SpriteMaterial({ map, depthTest: false }));
        const height = 0.07 * this.panel.size;
        sprite.scale.set(height * canvas.width / canvas.height, height, 1);
        sprite.center.set(0.5, -0.35);
        sprite.renderOrder = 1;  // over the floor, which is transparent, too
        return sprite;
    }

    // The range of a hinge in the plane normal to its axis, and the part on this side of zero.
    arc(joint, radius) {
        const T = this.THREE, axis = new T.Vector3(...joint.axis);
        const across = new T.Vector3(1, 0, 0);
        if (Math.abs(axis.x) > 0.9) { across.set(0, 0, 1); }
        const u = across.addScaledVector(axis, -across.dot(axis)).normalize();
        const v = new T.Vector3().crossVectors(axis, u);
        const at = angle => new T.Vector3().addScaledVector(u, radius * Math.cos(angle))
            .addScaledVector(v, radius * Math.sin(angle));
        const line = (from, to, color) => {
            const points = Array.from({ length: 65 }, (_, i) => at(from + (to - from) * i / 64));
            const geometry = new T.BufferGeometry().setFromPoints(points);
            return new T.Line(geometry, new T.LineBasicMaterial({ color, depthTest: false }));
        };
        const whole = new T.Group();
        const pointer = new T.Line(
            new T.BufferGeometry().setFromPoints([new T.Vector3(), at(0)]),
            new T.LineBasicMaterial({ color: 0x0072b2, depthTest: false }),
        );
        whole.add(line(joint.range[0], joint.range[1], 0x8793a0), pointer);
        whole.visible = false;
        return { whole, pointer, axis };
    }

    labels() {
        const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
        this.names.append(svg);
        this.tags = this.panel.joints.map(joint => {
            const tag = document.createElement("div"), lead = document.createElementNS(svg.namespaceURI, "line");
            tag.className = "label";
            tag.textContent = joint.name;
            svg.append(lead);
            this.names.append(tag);
            return { joint, tag, lead };
        });
        this.names.style.display = "none";
    }

    show(what, shown) {
        this.shown[what] = shown;
        this.names.style.display = this.shown.names ? "" : "none";
        for (const { frame, arc } of this.frames) {
            frame.visible = this.shown.frames;
            if (arc !== null) { arc.whole.visible = this.shown.arcs; }
        }
        this.viewer.set_dirty();
    }

    // Poses of joints at a time, between the samples of the panel.
    pose(joint, t) {
        const T = this.THREE, K = joint.at.length - 1;
        const x = Math.min(Math.max(t / this.panel.duration, 0), 1) * K;
        const i = Math.min(Math.floor(x), K - 1), s = x - i, a = joint.at[i], b = joint.at[i + 1];
        const q = new T.Quaternion(a[3], a[4], a[5], a[6]);
        return {
            p: new T.Vector3(...[0, 1, 2].map(k => a[k] + s * (b[k] - a[k]))),
            q: q.slerp(new T.Quaternion(b[3], b[4], b[5], b[6]), s),
        };
    }

    update(t, value) {
        for (const { joint, frame, arc } of this.frames) {
            if (!frame.visible && (arc === null || !arc.whole.visible)) { continue; }
            const { p, q } = this.pose(joint, t);
            frame.position.copy(p);
            frame.quaternion.copy(q);
            if (arc === null) { continue; }
            // The range stands still where the joint turns: undo the joint's own angle.
            const angle = value(joint.index);
            const back = new this.THREE.Quaternion().setFromAxisAngle(arc.axis, -angle);
            arc.whole.position.copy(p);
            arc.whole.quaternion.copy(q).multiply(back);
            arc.pointer.quaternion.setFromAxisAngle(arc.axis, angle);
        }
        if (this.shown.names) { this.place(t); }
    }

    // Names in two columns beside the robot, none over another, each with a line to its joint.
    place(t) {
        const T = this.THREE, width = this.pane.clientWidth, height = this.pane.clientHeight;
        const shift = new T.Vector3(...this.panel.shift), STEP = 20, TOP = 64;
        const columns = [[], []];
        for (const each of this.tags) {
            const world = this.pose(each.joint, t).p.add(shift).applyMatrix4(this.viewer.scene.matrixWorld);
            const seen = world.project(this.viewer.camera);
            each.x = (0.5 + 0.5 * seen.x) * width;
            each.y = (0.5 - 0.5 * seen.y) * height;
        }
        const middle = this.tags.reduce((sum, each) => sum + each.x, 0) / this.tags.length;
        for (const each of this.tags) { columns[each.x < middle ? 0 : 1].push(each); }
        columns.forEach((column, side) => {
            column.sort((a, b) => a.y - b.y);
            const room = Math.max(1, Math.floor((height - TOP - 8) / STEP));
            let next = Math.min(TOP, height - STEP);
            column.forEach((each, i) => {
                const hidden = i >= room;
                each.tag.style.display = each.lead.style.display = hidden ? "none" : "";
                if (hidden) { return; }
                const after = Math.min(room, column.length) - i;
                const y = Math.min(Math.max(each.y - 9, next), height - 6 - STEP * after);
                next = y + STEP;
                const x = side === 0 ? 10 : width - each.tag.offsetWidth - 10;
                each.tag.style.transform = `translate(${x}px, ${y}px)`;
                const end = side === 0 ? x + each.tag.offsetWidth : x;
                for (const [name, at] of [["x1", end], ["y1", y + 9], ["x2", each.x], ["y2", each.y]]) {
                    each.lead.setAttribute(name, at);
                }
            });
        });
    }

    resize() {
        const whole = MeshCat.Viewer.prototype.set_3d_pane_size;
        whole.call(this.viewer, Math.max(this.pane.clientWidth, 1), Math.max(this.pane.clientHeight, 1));
        if (!this.turned) { this.look(); }
    }

    // The camera in a direction of the world's frame, as near as the motion allows.
    look_from(direction) {
        this.panel.view = direction;
        this.turned = false;
        this.look();
    }

    // The camera at a point of the world's frame, looking at another one: the middle for null.
    stand(position, target) {
        const T = this.THREE, camera = this.viewer.camera, shift = new T.Vector3(...this.panel.shift);
        const page = p => { const q = new T.Vector3(...p).add(shift); return new T.Vector3(q.x, q.z, -q.y); };
        this.turned = true;
        camera.fov = 32;
        camera.position.copy(page(position));
        this.viewer.controls.target.copy(target === null ? new T.Vector3() : page(target));
        const distance = camera.position.distanceTo(this.viewer.controls.target);
        camera.near = Math.min(0.01 * distance, 0.1);
        camera.far = 20 * Math.max(distance, this.panel.size);
        this.viewer.controls.update();
        camera.updateProjectionMatrix();
        this.viewer.set_dirty();
    }

    // The camera as near as the box that the motion sweeps allows, in a window of any shape.
    look() {
        const T = this.THREE, camera = this.viewer.camera, panel = this.panel;
        camera.fov = 32;
        const aspect = this.pane.clientWidth / Math.max(this.pane.clientHeight, 1);
        const up = Math.tan(camera.fov * Math.PI / 360) * 0.9, across = up * aspect;
        const d = new T.Vector3(...panel.view).normalize();
        const right = new T.Vector3(0, 0, 1).cross(d).normalize();
        const high = new T.Vector3().crossVectors(d, right);
        let distance = 0;
        for (let i = 0; i < 8; i++) {
            const corner = new T.Vector3(...panel.half.map((h, k) => (i >> k) & 1 ? h : -h));
            const near = corner.dot(d);
            distance = Math.max(
                distance,
                near + Math.abs(corner.dot(right)) / across,
                near + Math.abs(corner.dot(high)) / up,
            );
        }
        const at = d.multiplyScalar(distance);
        camera.position.set(at.x, at.z, -at.y);
        camera.near = Math.min(0.01 * distance, 0.1);
        camera.far = 20 * distance;
        this.viewer.controls.target.set(0, 0, 0);
        camera.updateProjectionMatrix();
        this.viewer.set_dirty();
    }
}
