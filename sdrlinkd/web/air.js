// Who is on the air when, the band, and the points of the last burst; `show` brings what is new.
const KEPT_MS = 12000;
const ROW = 34;
const LEFT = 86;
const BOTTOM = 26;
const FALL_ROWS = 150;
const LOWEST_DB = -110, HIGHEST_DB = -10;
const GUARD_MS = 0.02;
const DASH = { urgent: 1, latency: 0.75, default: 0.5, bulk: 0.3 };

export default {
  template: `
    <div class="sdr-air">
      <div class="sdr-air-head">
        <strong>Bursts</strong>
        <label>last <select v-model.number="span" @change="draw">
          <option :value="100">0.1 s</option><option :value="500">0.5 s</option>
          <option :value="2000">2 s</option><option :value="10000">10 s</option></select></label>
        <span>taller: more urgent; number: MCS; crossed: overlaps another, was damaged, or did not leave</span>
        <span role="status">{{ summary }}</span>
      </div>
      <canvas ref="bursts" class="sdr-bursts" role="img" :aria-label="summary"></canvas>
      <div class="sdr-air-below">
        <figure><figcaption>Spectrum: mean and peak, dBFS{{ bandText }}</figcaption>
          <canvas ref="spectrum" role="img" aria-label="Spectrum"></canvas></figure>
        <figure><figcaption>Waterfall of peaks, newest on top{{ lineText }}</figcaption>
          <canvas ref="fall" role="img" aria-label="Waterfall"></canvas></figure>
        <figure class="square"><figcaption>Last burst: {{ modulation || "none yet" }}</figcaption>
          <canvas ref="points" role="img" aria-label="Constellation"></canvas></figure>
      </div>
    </div>`,
  props: { colors: Array },
  data() {
    return { span: 2000, summary: "nothing heard yet", modulation: "", bandText: "", lineText: "" };
  },
  created() {
    // Not reactive: thousands of bars.
    this.bars = [];
    this.rows = [];
    this.unreadable = [];
    this.band = null;
    this.now = 0;
  },
  mounted() {
    this.watcher = new ResizeObserver(() => this.draw());
    this.watcher.observe(this.$el);
  },
  unmounted() {
    this.watcher.disconnect();
  },
  methods: {
    clear() {
      this.bars = [];
      this.rows = [];
      this.unreadable = [];
      this.band = null;
      this.points = null;
      this.draw();
    },
    show(told) {
      this.now = told.now_ms;
      this.bars = this.bars.filter((bar) => bar.at_ms > this.now - KEPT_MS);
      this.unreadable = this.unreadable.filter(([at]) => at > this.now - KEPT_MS);
      if (told.bars.length) {
        this.bars.push(...told.bars);
        this.bars.sort((a, b) => a.at_ms - b.at_ms);
        this.markOverlaps();
      }
      if (told.band) {
        this.band = told.band;
        this.rows.unshift(told.band.peak);
        this.rows.length = Math.min(this.rows.length, FALL_ROWS);
        if (told.band.points.length) this.modulation = told.band.modulation;
        const rate = told.band.rate / 1e6;
        this.unreadable.push([this.now, told.band.unreadable]);
        this.lineText = this.told(told.band.lines);
        this.bandText = `, ${rate.toFixed(rate < 10 ? 1 : 0)} MHz wide`;
      }
      this.draw();
    },
    markOverlaps() {
      // Bars are in the order of their starts.
      let last = null;
      for (const bar of this.bars) bar.hit = bar.n_good < bar.n_pdus;
      for (const bar of this.bars) {
        const end = bar.at_ms + bar.length_ms;
        if (last && bar.robot !== last.robot && bar.at_ms < last.at_ms + last.length_ms - GUARD_MS) {
          bar.hit = last.hit = true;
        }
        if (!last || end > last.at_ms + last.length_ms) last = bar;
      }
    },
    draw() {
      if (!this.$refs.bursts) return;
      this.drawBursts();
      this.drawSpectrum();
      this.drawFall();
      this.drawPoints();
    },
    prepared(canvas, height) {
      const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth;
      canvas.style.height = `${height}px`;
      canvas.width = width * ratio;
      canvas.height = height * ratio;
      const pen = canvas.getContext("2d");
      pen.scale(ratio, ratio);
      const style = getComputedStyle(this.$el);
      this.ink = style.getPropertyValue("--ink");
      this.line = style.getPropertyValue("--line");
      this.poor = style.getPropertyValue("--poor");
      pen.font = "14px sans-serif";
      return [pen, width];
    },
    color(robot) {
      return robot == null ? "#888" : this.colors[robot % this.colors.length];
    },
    drawBursts() {
      const from = this.now - this.span;
      const shown = this.bars.filter((bar) => bar.at_ms + bar.length_ms > from);
      const robots = [...new Set(this.bars.map((bar) => bar.robot))].sort((a, b) => (a ?? 999) - (b ?? 999));
      const [pen, width] = this.prepared(this.$refs.bursts, Math.max(1, robots.length) * ROW + BOTTOM);
      const scale = (width - LEFT - 10) / this.span;
      robots.forEach((robot, row) => {
        pen.fillStyle = this.ink;
        pen.fillText(robot == null ? "unknown" : `robot ${robot}`, 4, row * ROW + 22);
        pen.fillStyle = this.line;
        pen.fillRect(LEFT, row * ROW + ROW - 3, width - LEFT - 10, 1);
      });
      let busy = 0, hits = 0;
      for (const bar of shown) {
        const x = LEFT + Math.max(0, bar.at_ms - from) * scale;
        const wide = Math.max(1, (bar.length_ms - Math.max(0, from - bar.at_ms)) * scale);
        const high = (ROW - 8) * (DASH[bar.qos] || 0.5);
        const y = robots.indexOf(bar.robot) * ROW + ROW - 4 - high;
        pen.fillStyle = this.color(bar.robot);
        pen.fillRect(x, y, wide, high);
        busy += bar.length_ms;
        if (bar.hit) {
          hits += 1;
          pen.strokeStyle = this.poor;
          pen.lineWidth = 2;
          const reach = Math.max(wide, 6);
          pen.beginPath();
          pen.moveTo(x, y);
          pen.lineTo(x + reach, y + high);
          pen.moveTo(x + reach, y);
          pen.lineTo(x, y + high);
          pen.stroke();
        }
        if (wide > 14 && high > 12) {
          pen.fillStyle = "#fff";
          pen.fillText(bar.mcs, x + 3, y + high - 3);
        }
      }
      pen.fillStyle = this.ink;
      for (let i = 0; i <= 4; i++) {
        const text = i === 4 ? "now" : `-${((this.span * (4 - i)) / 4000).toFixed(this.span < 500 ? 3 : 2)} s`;
        pen.textAlign = i === 4 ? "right" : "left";
        pen.fillText(text, LEFT + ((width - LEFT - 10) * i) / 4, robots.length * ROW + 18);
      }
      pen.textAlign = "left";
      const share = (100 * busy) / this.span;
      const lost = this.unreadable.filter(([at]) => at > from).reduce((sum, [, n]) => sum + n, 0);
      const unread = lost ? `, and ${lost} of which not even the header could be read` : "";
      this.summary = shown.length || lost
        ? `${shown.length} bursts, ${share.toFixed(1)} % of the time, ${hits} crossed${unread}`
        : "no burst in this time";
    },
    told(lines) {
      if (!lines.length) return "";
      const shown = lines.slice(0, 3).map((hz) => `${hz < 0 ? "−" : "+"}${Math.round(Math.abs(hz) / 1e3)} kHz`);
      const more = lines.length > 3 ? ` and ${lines.length - 3} more` : "";
      return `; notched (marked): ${shown.join(", ")}${more}`;
    },
    drawSpectrum() {
      const [pen, width] = this.prepared(this.$refs.spectrum, 200);
      if (!this.band) return;
      const toY = (level) => (200 * (HIGHEST_DB - level)) / (HIGHEST_DB - LOWEST_DB);
      pen.fillStyle = this.ink;
      pen.strokeStyle = this.line;
      for (let level = -100; level < 0; level += 20) {
        pen.beginPath();
        pen.moveTo(0, toY(level));
        pen.lineTo(width, toY(level));
        pen.stroke();
        pen.fillText(level, 2, toY(level) - 2);
      }
      [["mean", this.colors[1]], ["peak", this.ink]].forEach(([name, color]) => {
        pen.strokeStyle = color;
        pen.lineWidth = 2;
        pen.beginPath();
        this.band[name].forEach((level, i) => {
          const x = (width * (i + 0.5)) / this.band[name].length;
          if (i) pen.lineTo(x, toY(level));
          else pen.moveTo(x, toY(level));
        });
        pen.stroke();
      });
    },
    drawFall() {
      const [pen, width] = this.prepared(this.$refs.fall, 200);
      const tall = 200 / FALL_ROWS;
      this.rows.forEach((row, i) => {
        const wide = width / row.length;
        row.forEach((level, k) => {
          const share = Math.min(1, Math.max(0, (level - LOWEST_DB) / (HIGHEST_DB - LOWEST_DB)));
          pen.fillStyle = `hsl(${240 - 240 * share}, 90%, ${20 + 45 * share}%)`;
          pen.fillRect(k * wide, i * tall, wide + 1, tall + 1);
        });
      });
      // A triangle over each line that the receiver cuts out.
      pen.fillStyle = this.ink;
      (this.band ? this.band.lines : []).forEach((hz) => {
        const x = width * (0.5 + hz / this.band.rate);
        pen.beginPath();
        pen.moveTo(x - 5, 0);
        pen.lineTo(x + 5, 0);
        pen.lineTo(x, 9);
        pen.fill();
      });
    },
    drawPoints() {
      const [pen, width] = this.prepared(this.$refs.points, 200);
      const middle = [width / 2, 100], scale = 60 / 32;
      pen.strokeStyle = this.line;
      pen.strokeRect(middle[0] - 95, 5, 190, 190);
      pen.beginPath();
      pen.moveTo(middle[0], 5);
      pen.lineTo(middle[0], 195);
      pen.moveTo(middle[0] - 95, 100);
      pen.lineTo(middle[0] + 95, 100);
      pen.stroke();
      if (this.band && this.band.points.length) this.points = this.band.points;
      if (!this.points) return;
      pen.fillStyle = this.colors[1];
      for (let i = 0; i + 1 < this.points.length; i += 2) {
        pen.fillRect(middle[0] + this.points[i] * scale - 1.5, middle[1] - this.points[i + 1] * scale - 1.5, 3, 3);
      }
    },
  },
};
