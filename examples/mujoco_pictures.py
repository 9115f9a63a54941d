"""Pictures of a run of `mujoco_loop.py`: curves over time (matplotlib), and an animation (Pillow and OpenGL)."""

from pathlib import Path

import numpy as np
from mujoco_plant import CELLS, DT, SECURITY, SUBSTEPS, Run, mujoco


def draw(run: Run, file: Path) -> None:
    """Draw distance, errors, rates and statuses over time."""
    from redundancy import plots
    from redundancy.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, Figure, mpl

    fine = np.linspace(0.0, run.time[-1] + DT, len(run.distance))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 6.0), layout="constrained")
        apart, error, rate, strip = figure.subplots(4, 1, sharex=True, height_ratios=[1.3, 1.0, 1.0, 0.12])
        right = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "fontsize": "small"}
        apart.plot(fine, 1e3 * run.distance, color=BLUE, label="simulated")
        apart.plot(run.time, 1e3 * run.unavoided[:-1], color=GREY, linestyle="--", linewidth=1.2, label="not avoiding")
        apart.axhline(1e3 * SECURITY, color=BLACK, linewidth=1.0, linestyle=":", label="security")
        apart.set(ylabel="distance [mm]", title=f"{run.name}, {run.path}")
        apart.legend(**right)
        error.semilogy(run.time, 1e3 * run.position_error, color=BLUE, label="position [mm]")
        error.semilogy(run.time, 1e3 * run.angle_error, color=ORANGE, label="angle [mrad]")
        error.set(ylabel="error of the hand", ylim=(1e-4, 1e3), yticks=[1e-4, 1e-2, 1e0, 1e2])
        error.legend(**right)
        shades = mpl.colormaps["viridis"](np.linspace(0.0, 0.9, run.robot.n))
        for i, column in enumerate((run.qd / run.robot.qd_max)[::SUBSTEPS].T):
            rate.plot(fine[::SUBSTEPS], column, color=shades[i], linewidth=1.0, label=f"$\\dot q_{{{i + 1}}}$")
        rate.set(ylabel="rate / its limit", ylim=(-1.05, 1.05), yticks=[-1.0, -0.5, 0.0, 0.5, 1.0])
        rate.legend(**right)
        status = np.array(run.status)
        colors = {"solved": GREEN, "relaxed": ORANGE, "limited": PURPLE, "returning": SKY, "infeasible": BLACK}
        for name in (name for name in colors if name in run.status):
            strip.fill_between(
                run.time, 0.0, 1.0, where=status == name, step="post", color=colors[name], label=name, linewidth=0
            )
        strip.set(xlabel="time [s]", yticks=[], ylim=(0.0, 1.0), xlim=(0.0, fine[-1]))
        strip.legend(**right)
        figure.align_ylabels()
    plots.save(figure, file)


def animate(run: Run, file: Path, every: float = 0.1, size: tuple[int, int] = (480, 400)) -> None:
    """Write an animation, a frame every so many seconds."""
    from PIL import Image, ImageDraw, ImageFont

    model = mujoco.MjModel.from_xml_string(run.model)
    data = mujoco.MjData(model)
    renderer = mujoco.Renderer(model, 2 * size[1], 2 * size[0])
    camera = mujoco.MjvCamera()
    x, y, z, camera.distance, camera.azimuth, camera.elevation = CELLS[run.name].camera
    camera.lookat[:] = x, y, z
    font = ImageFont.load_default(16)
    frames = []
    for k in range(0, len(run.time), round(every / DT)):
        data.qpos[:] = run.q[SUBSTEPS * k]
        data.mocap_pos[0] = run.ball[SUBSTEPS * k]
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera)
        frame = Image.fromarray(renderer.render()).resize(size, Image.Resampling.LANCZOS)
        label = f"{run.time[k]:4.1f} s    distance {1e3 * run.distance[SUBSTEPS * k]:3.0f} mm    {run.status[k]}"
        ImageDraw.Draw(frame).text((12, 10), label, fill="black", font=font)
        frames.append(frame)
    renderer.close()
    # One palette for all frames, without dithering: what stands still costs nothing.
    sample = Image.new("RGB", (size[0], 4 * size[1]))
    for i in range(4):
        sample.paste(frames[i * (len(frames) - 1) // 3], (0, i * size[1]))
    sample.paste((0, 158, 115), (0, 0, 60, 60))
    palette = sample.quantize(160, dither=Image.Dither.NONE)
    few = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    few[0].save(file, save_all=True, append_images=few[1:], duration=round(1e3 * every), loop=0, optimize=True)
