#!/usr/bin/python3
"""Rows of docs/evidence for suspensions between walls: one line per trajectories.h5 (needs python3-h5py).

usage: tools/suspension_table.py [--from MS] [--to MS] [--lag MS] RUN...

Times in ms. Core: the middle 40 % of the gap. Square displacements across the stream (y) are over all cells and
all origins of the window, um2, +- the standard error over cells. Stress, velocity and hematocrit are means over the window;
mu is that of the default plasma.
"""
import argparse
import os

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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="begin", type=float, default=30)
    parser.add_argument("--to", dest="end", type=float, default=1e9)
    parser.add_argument("--lag", type=float, default=20)
    parser.add_argument("runs", nargs="+")
    a = parser.parse_args()
    print("| run | stress, Pa (over mu gamma) | core shear/gamma | shear at the walls/gamma | spread of u(y) + u(mirror)/U "
          "| vorticity velocity/U | core Ht | plasma layer, um | red cells' displacement2 | platelets' | momentum residual "
          "| volume error |")
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
            rows, t = [], f["time"][:]
            for kind in ("rbc", "platelet"):
                if kind not in f:
                    rows.append("-")
                    continue
                mean, error = square_displacement(f[kind + "/position"][:], t, inside(t), 1e-3 * a.lag)
                rows.append(f"{mean:.3f} +- {error:.3f}")
            mu_gamma = 1.025e-3 * rate
            print(f"| {run} | {stress:.4f} ({stress / mu_gamma:.3f}) | {shear:.3f} | {walls[0]:.2f}, {walls[1]:.2f} "
                  f"| {(mirrored.max() - mirrored.min()) / speed:.3f} | {abs(u[:, 0].mean()) / speed:.4f} "
                  f"| {phi[core].mean():.3f} | {np.mean(layer):.2f} | {rows[0]} | {rows[1]} "
                  f"| {np.abs(f['diagnostics/momentum_residual'][:][sampled]).max():.1e} "
                  f"| {np.abs(f['diagnostics/volume_error_max'][:][sampled]).max():.4f} |")


if __name__ == "__main__":
    main()
