#!/usr/bin/python3
"""Rows of docs/evidence for suspensions between walls: one line per trajectories.h5 (needs python3-h5py).

usage: tools/suspension_table.py [--from MS] [--to MS] [--lag MS] [--profiles STEM] RUN...

Times in ms. Core: the middle 40 % of the gap. Square displacements across the stream (y) are over all cells and
all origins of the window, um2, +- the standard error over cells. Stress, velocity and hematocrit are means over the window;
mu is that of the default plasma. Longest step: of any cell between two samples, along the flow over that of a wall
relative to the other, and across it, um. --profiles STEM writes STEM.csv and, with gnuplot, STEM.svg: the mean velocity
over the height, a curve per run (plasma alone: walls at +- U/2).
"""
import argparse
import os
import subprocess

import h5py
import numpy as np


def square_displacement(position, time, window, lag):
    """position: samples x cells x 3 (m), time (s). Returns mean and standard error over cells, um2."""
    y = 1e6 * position[window, :, 1]
    step = int(round(lag / (time[1] - time[0])))
    if y.shape[0] <= step:
        return float("nan"), float("nan")
    per_cell = ((y[step:] - y[:-step]) ** 2).mean(axis=0)
    return per_cell.mean(), per_cell.std(ddof=1) / np.sqrt(len(per_cell))


def longest_step(position, way):
    """Between neighbouring samples: along the flow, over way; across it, um."""
    step = np.abs(np.diff(position, axis=0))
    return step[:, :, 2].max() / way, 1e6 * step[:, :, 1].max()


def draw(stem, curves):
    """curves: (label, height over gap, velocity over U)."""
    with open(stem + ".csv", "w") as out:
        out.write("curve,x,y,error\n")
        for label, x, y in curves:
            out.writelines(f'"{label}",{a:.6g},{b:.6g},\n' for a, b in zip(x, y))
    colours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"]
    plots = [f"'-' using 1:2 with lines lw 2 lc rgb '{colours[i % 4]}' title '{c[0]}'" for i, c in enumerate(curves)]
    plots.append("x - 0.5 with lines lw 1.5 dt 2 lc rgb '#888888' title 'plasma alone'")
    script = ("set encoding utf8\nset terminal svg size 860,400 font 'sans-serif,13' background '#ffffff'\n"
              f"set output '{stem}.svg'\nset xlabel 'height over gap'\nset ylabel 'velocity over U'\nset grid lc rgb '#dddddd'\n"
              "set key outside right center noenhanced samplen 2\nset border 3 lc rgb '#444444'\nset tics nomirror\n"
              f"set xrange [0:1]\nplot {', '.join(plots)}\n")
    for _, x, y in curves:
        script += "".join(f"{a:.6g} {b:.6g}\n" for a, b in zip(x, y)) + "e\n"
    try:
        subprocess.run(["gnuplot"], input=script, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        print("no drawing: gnuplot is missing or failed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="begin", type=float, default=30)
    parser.add_argument("--to", dest="end", type=float, default=1e9)
    parser.add_argument("--lag", type=float, default=20)
    parser.add_argument("--profiles", metavar="STEM")
    parser.add_argument("runs", nargs="+")
    a = parser.parse_args()
    curves = []
    print("| run | stress, Pa (over mu gamma) | core shear/gamma | shear at the walls/gamma | spread of u(y) + u(mirror)/U "
          "| vorticity velocity/U | core Ht | plasma layer, um | red cells' displacement2 | platelets' | momentum residual "
          "| volume error | longest step |")
    for run in a.runs:
        path = run if run.endswith(".h5") else os.path.join(run, "trajectories.h5")
        with h5py.File(path, "r") as f:
            inside = lambda t: (t > 1e-3 * a.begin - 1e-9) & (t < 1e-3 * a.end + 1e-9)
            y, height = f["profile/y"][:], float(f.attrs["walls_y"][1] - f.attrs["walls_y"][0])
            rate = float(f.attrs["shear_rate"])
            window = inside(f["profile/time"][:])
            u = f["profile/velocity"][:][window].mean(axis=0)
            phi = f["profile/hematocrit"][:][window].mean(axis=0)
            stress = f["profile/shear_stress"][:][window].mean()
            at = (y - f.attrs["walls_y"][0]) / height
            core = (at > 0.3) & (at < 0.7)
            speed = rate * height
            shear = abs(np.polyfit(y[core], u[core, 2], 1)[0]) / rate
            dy = y[1] - y[0]
            walls = [abs(u[i, 2] - u[j, 2]) / dy / rate for i, j in ((0, 1), (-1, -2))]
            mirrored = u[:, 2] + u[::-1, 2]
            half = phi[core].mean() / 2
            layer = [np.interp(half, p[: len(p) // 2], (np.arange(len(p)) + 0.5)[: len(p) // 2] * dy * 1e6)
                     for p in (np.maximum.accumulate(phi), np.maximum.accumulate(phi[::-1]))]
            sampled = inside(f["diagnostics/time"][:])
            rows, t, steps = [], f["time"][:], []
            for kind in ("rbc", "platelet"):
                if kind not in f:
                    rows.append("-")
                    continue
                mean, error = square_displacement(f[kind + "/position"][:], t, inside(t), 1e-3 * a.lag)
                rows.append(f"{mean:.3f} +- {error:.3f}")
                steps.append(longest_step(f[kind + "/position"][:][inside(t)], speed * (t[1] - t[0])))
            along, across = np.max(steps, axis=0)
            curves.append((os.path.basename(os.path.normpath(run)), at, u[:, 2] / speed))
            mu_gamma = 1.025e-3 * rate
            print(f"| {run} | {stress:.4f} ({stress / mu_gamma:.3f}) | {shear:.3f} | {walls[0]:.2f}, {walls[1]:.2f} "
                  f"| {(mirrored.max() - mirrored.min()) / speed:.3f} | {abs(u[:, 0].mean()) / speed:.4f} "
                  f"| {phi[core].mean():.3f} | {np.mean(layer):.2f} | {rows[0]} | {rows[1]} "
                  f"| {np.abs(f['diagnostics/momentum_residual'][:][sampled]).max():.1e} "
                  f"| {np.abs(f['diagnostics/volume_error_max'][:][sampled]).max():.4f} "
                  f"| {along:.2f} ({across:.2f}) |")
    if a.profiles:
        draw(a.profiles, curves)


if __name__ == "__main__":
    main()
