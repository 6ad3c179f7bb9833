// The map: robots, their paths and links, drawn in m; `show` and `trails` bring what is new.
const MARGIN = 0.12;
const RING_PX = 0.36;

export default {
  template: `
    <div class="sdr-map" tabindex="0" ref="box" @keydown="key" role="application"
         aria-label="Map of robots; arrow keys move it, plus and minus zoom, 0 fits">
      <svg ref="svg" @wheel.prevent="wheel" @pointerdown="grab" @pointermove="drag"
           @pointerup="release" @pointercancel="release" @dblclick="fit">
        <image v-if="plan" :href="plan.url" v-bind="planBox" preserveAspectRatio="none"
               class="plan"/>
        <g class="grid">
          <line v-for="line in grid" :key="line.key" :x1="line.x1" :y1="line.y1" :x2="line.x2"
                :y2="line.y2" :class="{axis: line.axis}"/>
        </g>
        <polyline v-for="path in paths" :key="path.robot + (path.sent ? 's' : 'r')"
                  :points="line(path.points)" :class="['path', path.sent ? 'sent' : 'received']"
                  :style="{stroke: color(path.robot)}" fill="none"/>
        <g v-for="link in drawn" :key="link.a + '-' + link.b">
          <line :x1="link.x1" :y1="link.y1" :x2="link.x2" :y2="link.y2"
                :class="['link', link.level, {told: link.told}]" :data-link="link.a + '-' + link.b">
            <title>{{ link.title }}</title>
          </line>
          <text :x="(link.x1 + link.x2) / 2" :y="(link.y1 + link.y2) / 2 - 5" class="link-text">{{
            link.text }}</text>
        </g>
        <line v-for="hop in hops" :key="hop.key" :x1="hop.x1" :y1="hop.y1" :x2="hop.x2"
              :y2="hop.y2" class="hop" marker-end="url(#arrow)"><title>{{ hop.title }}</title></line>
        <defs><marker id="arrow" viewBox="0 0 10 10" refX="24" refY="5" markerWidth="8"
          markerHeight="8" orient="auto"><path d="M0 0L10 5L0 10z"/></marker></defs>
        <g v-for="robot in placed" :key="robot.id" :data-robot="robot.id"
           :transform="'translate(' + robot.px + ' ' + robot.py + ')'"
           :class="['robot', robot.level, {silent: robot.silent, unknown: robot.unknown}]">
          <path v-if="robot.heading !== undefined" d="M22 0L12 -7L12 7z" class="nose"
                :transform="'rotate(' + (-robot.heading * 180 / Math.PI) + ')'"/>
          <circle r="13" :style="{fill: color(robot.id)}"/>
          <text class="id" dy="5">{{ robot.id }}</text>
          <text class="note" y="30">{{ robot.note }}</text>
          <title>{{ robot.title }}</title>
        </g>
        <g v-if="scale" class="scale" :transform="'translate(16 ' + (height - 18) + ')'">
          <path :d="'M0 -6V0H' + scale.px + 'V-6'" fill="none"/>
          <text :x="scale.px + 8" y="2">{{ scale.text }}</text>
        </g>
      </svg>
      <div class="sdr-map-buttons">
        <button @click="zoom(1.4)" aria-label="Zoom in">+</button>
        <button @click="zoom(1 / 1.4)" aria-label="Zoom out">&minus;</button>
        <button @click="fit" aria-label="Fit all robots" :class="{on: follows}">fit</button>
      </div>
    </div>`,
  props: { plan: Object, colors: Array },
  data() {
    return {
      robots: [], links: [], flows: [], paths: [],
      width: 800, height: 500, cx: 0, cy: 0, perMetre: 20, follows: true, grabbed: null,
    };
  },
  mounted() {
    this.watcher = new ResizeObserver(() => {
      this.width = this.$refs.svg.clientWidth || this.width;
      this.height = this.$refs.svg.clientHeight || this.height;
      this.refit();
    });
    this.watcher.observe(this.$refs.box);
    this.$emit("ready");
  },
  unmounted() {
    this.watcher.disconnect();
  },
  computed: {
    placed() {
      const unknown = this.robots.filter((robot) => robot.x === undefined);
      return this.robots.map((robot) => {
        const at = unknown.indexOf(robot);
        const angle = (2 * Math.PI * at) / Math.max(1, unknown.length) - Math.PI / 2;
        const ring = RING_PX * Math.min(this.width, this.height);
        const px = at < 0 ? this.toX(robot.x) : this.width / 2 + ring * Math.cos(angle);
        const py = at < 0 ? this.toY(robot.y) : this.height / 2 + ring * Math.sin(angle);
        const note = robot.silent ? "silent" : at >= 0 ? "no position"
          : robot.old_s > 3 ? `${robot.old_s.toFixed(0)} s old` : "";
        const where = at >= 0 ? "" : `, ${robot.x.toFixed(1)} m east, ${robot.y.toFixed(1)} m north`;
        const title = `robot ${robot.id}${where}${robot.topic ? `, by ${robot.topic}` : ""}`;
        return { ...robot, px, py, note, title, unknown: at >= 0 };
      });
    },
    places() {
      return new Map(this.placed.map((robot) => [robot.id, robot]));
    },
    drawn() {
      return this.links.flatMap((link) => {
        const a = this.places.get(link.a), b = this.places.get(link.b);
        if (!a || !b) return [];
        const snr = [link.snr_a, link.snr_b].filter((each) => each != null);
        const text = snr.length ? `${Math.min(...snr).toFixed(0)} dB` : "";
        return [{ ...link, x1: a.px, y1: a.py, x2: b.px, y2: b.py, text, title: this.words(link) }];
      });
    },
    hops() {
      return this.flows.flatMap((flow) => flow.via.flatMap((via) => {
        const a = this.places.get(flow.from), b = this.places.get(via);
        if (!a || !b) return [];
        const to = flow.dst == null ? "everyone" : `robot ${flow.dst}`;
        return [{
          key: `${flow.src}-${flow.dst}-${via}`, x1: a.px, y1: a.py, x2: b.px, y2: b.py,
          title: `from robot ${flow.src} to ${to}: robot ${via} forwards`,
        }];
      }));
    },
    isPlaced() {
      return this.robots.some((robot) => robot.x !== undefined);
    },
    step() {
      const rough = 90 / this.perMetre;
      const power = Math.pow(10, Math.floor(Math.log10(rough)));
      return [1, 2, 5, 10].map((each) => each * power).find((each) => each >= rough);
    },
    grid() {
      if (!this.isPlaced && !this.plan) return [];
      const lines = [];
      const [west, north] = this.fromPixel(0, 0), [east, south] = this.fromPixel(this.width, this.height);
      for (let x = Math.ceil(west / this.step); x * this.step < east; x++) {
        const px = this.toX(x * this.step);
        lines.push({ key: `x${x}`, x1: px, x2: px, y1: 0, y2: this.height, axis: x === 0 });
      }
      for (let y = Math.ceil(south / this.step); y * this.step < north; y++) {
        const py = this.toY(y * this.step);
        lines.push({ key: `y${y}`, x1: 0, x2: this.width, y1: py, y2: py, axis: y === 0 });
      }
      return lines;
    },
    scale() {
      if (!this.isPlaced && !this.plan) return null;
      const text = this.step >= 1000 ? `${this.step / 1000} km` : this.step >= 1 ? `${this.step} m`
        : `${+(this.step * 100).toPrecision(2)} cm`;
      return { px: this.step * this.perMetre, text };
    },
    planBox() {
      const { x, y, width, height } = this.plan;
      return {
        x: this.toX(x), y: this.toY(y + height),
        width: width * this.perMetre, height: height * this.perMetre,
      };
    },
  },
  methods: {
    show(view) {
      this.robots = view.robots;
      this.links = view.links;
      this.flows = view.flows;
      this.refit();
    },
    trails(paths) {
      this.paths = paths;
    },
    refit() {
      if (!this.follows || this.grabbed) return;
      const points = this.robots.filter((robot) => robot.x !== undefined).map((r) => [r.x, r.y]);
      for (const path of this.paths) points.push(...path.points);
      if (this.plan) {
        const { x, y, width, height } = this.plan;
        points.push([x, y], [x + width, y + height]);
      }
      if (!points.length) return;
      const xs = points.map((each) => each[0]), ys = points.map((each) => each[1]);
      const west = Math.min(...xs), east = Math.max(...xs);
      const south = Math.min(...ys), north = Math.max(...ys);
      this.cx = (west + east) / 2;
      this.cy = (south + north) / 2;
      const room = 1 - 2 * MARGIN;
      this.perMetre = Math.min(
        (room * this.width) / Math.max(east - west, 2), (room * this.height) / Math.max(north - south, 2));
    },
    toX(x) { return this.width / 2 + (x - this.cx) * this.perMetre; },
    toY(y) { return this.height / 2 - (y - this.cy) * this.perMetre; },
    fromPixel(px, py) {
      return [this.cx + (px - this.width / 2) / this.perMetre, this.cy - (py - this.height / 2) / this.perMetre];
    },
    line(points) { return points.map(([x, y]) => `${this.toX(x).toFixed(1)},${this.toY(y).toFixed(1)}`).join(" "); },
    color(robot) { return this.colors[robot % this.colors.length]; },
    words(link) {
      const end = (at, from, key) => {
        const snr = link[`snr_${key}`], loss = link[`loss_${key}`];
        return `robot ${at} hears robot ${from}: ` +
          `${snr == null ? "SNR unknown" : `${snr.toFixed(1)} dB`}, ` +
          `${loss == null ? "loss unknown" : `${(100 * loss).toFixed(1)} % lost`}`;
      };
      const mcs = ["a", "b"].filter((key) => link[`mcs_${key}`] !== undefined)
        .map((key) => `robot ${link[key]} sends with MCS ${link[`mcs_${key}`]}`);
      const told = link.told ? ["as the team told"] : [];
      return [end(link.a, link.b, "a"), end(link.b, link.a, "b"), ...mcs, ...told].join("\n");
    },
    zoom(by, px = this.width / 2, py = this.height / 2) {
      const [x, y] = this.fromPixel(px, py);
      this.follows = false;
      this.perMetre = Math.min(5000, Math.max(0.001, this.perMetre * by));
      this.cx = x - (px - this.width / 2) / this.perMetre;
      this.cy = y + (py - this.height / 2) / this.perMetre;
    },
    move(dx, dy) {
      this.follows = false;
      this.cx += dx / this.perMetre;
      this.cy += dy / this.perMetre;
    },
    fit() {
      this.follows = true;
      this.refit();
    },
    wheel(event) {
      const box = this.$refs.svg.getBoundingClientRect();
      this.zoom(event.deltaY < 0 ? 1.2 : 1 / 1.2, event.clientX - box.left, event.clientY - box.top);
    },
    grab(event) {
      this.grabbed = [event.clientX, event.clientY];
      this.$refs.svg.setPointerCapture(event.pointerId);
    },
    drag(event) {
      if (!this.grabbed) return;
      this.move(this.grabbed[0] - event.clientX, event.clientY - this.grabbed[1]);
      this.grabbed = [event.clientX, event.clientY];
    },
    release() { this.grabbed = null; },
    key(event) {
      const by = 60;
      const moves = { ArrowLeft: [-by, 0], ArrowRight: [by, 0], ArrowUp: [0, by], ArrowDown: [0, -by] };
      if (moves[event.key]) this.move(...moves[event.key]);
      else if (event.key === "+" || event.key === "=") this.zoom(1.4);
      else if (event.key === "-") this.zoom(1 / 1.4);
      else if (event.key === "0") this.fit();
      else return;
      event.preventDefault();
    },
  },
};
