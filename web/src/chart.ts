// The TCP error over time, with a cursor at the instant shown.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { Recording } from "./recording";

export class ErrorChart {
  private plot?: uPlot;
  private time = 0;

  constructor(
    private readonly element: HTMLElement,
    private readonly seek: (time: number) => void,
  ) {
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(element);
  }

  private size(): { width: number; height: number } {
    return { width: Math.max(this.element.clientWidth, 100), height: Math.max(this.element.clientHeight, 120) };
  }

  show(recording: Recording): void {
    this.plot?.destroy();
    const color = (name: string) => getComputedStyle(this.element).getPropertyValue(name).trim();
    const inMm = (values: Float64Array) => Float64Array.from(values, (x) => 1e3 * x);
    const series: uPlot.Series[] = [{ label: "time, s" }, { label: "TCP error, mm", stroke: color("--accent"), width: 2 }];
    const data: Float64Array[] = [recording.times, inMm(recording.error)];
    if (recording.staticError.length > 0) {
      series.push({ label: "static part, mm", stroke: color("--quiet"), width: 1, dash: [6, 4] });
      data.push(inMm(recording.staticError));
    }
    const axis = { stroke: color("--text"), grid: { stroke: color("--line"), width: 1 }, ticks: { stroke: color("--line") } };
    this.plot = new uPlot(
      {
        ...this.size(),
        series,
        scales: { x: { time: false }, y: { range: (_, __, largest) => [0, 1.08 * (largest > 0 ? largest : 1)] } },
        axes: [{ ...axis, label: "time, s", size: 40, labelSize: 20 }, { ...axis, label: "mm", size: 52, labelSize: 18 }],
        legend: { show: false },
        cursor: { drag: { x: false, y: false } },
        hooks: { draw: [(plot) => this.drawInstant(plot)] },
      },
      data as unknown as uPlot.AlignedData,
      this.element,
    );
    const { over } = this.plot;
    const seek = (event: PointerEvent) => this.plot && this.seek(this.plot.posToVal(event.offsetX, "x"));
    over.addEventListener("pointerdown", (event) => {
      over.setPointerCapture(event.pointerId);
      seek(event);
    });
    over.addEventListener("pointermove", (event) => event.buttons === 1 && seek(event));
  }

  private drawInstant(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const x = plot.valToPos(this.time, "x", true);
    ctx.save();
    ctx.strokeStyle = getComputedStyle(this.element).getPropertyValue("--text");
    ctx.lineWidth = devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  move(time: number): void {
    this.time = time;
    this.plot?.redraw(false, false);
  }
}
