# SPDX-License-Identifier: Apache-2.0
"""Emulated arms with hidden values, identified: how far off, how often within the stated intervals. Minutes of a core.

    python3 tests/identify/study.py FOLDER_OF_SOURCES LIBRARY [FIRST:LAST [SEED]]

The library is tests/identify/arm.cpp. Prints each arm and the summary, which is that of docs/gains.md."""
import sys

import numpy as np

import arms as emulated
import boundary


def truth_of(arm):
    """In the order of estimate.NAMES."""
    from estimate import PAIRS
    return np.concatenate([[arm["mass"][i, j] for i, j in PAIRS], arm["viscous"], arm["coulomb"], arm["weight"], [0, 0, 0], [arm["delay"]]])


def identify_all(library, arms, seed=1):
    import estimate
    from experiment import SECONDS, Experiment
    experiment = Experiment(np.full(len(arms), emulated.LIMIT_N), seed=seed)
    places, forces = emulated.run(library, arms, experiment, SECONDS)
    found = []
    for n in range(len(arms)):
        motion = estimate.Motion(emulated.PERIOD_S, np.ascontiguousarray(places[:, n]), np.ascontiguousarray(forces[:, n]), np.ones(len(places), bool))
        try:
            found.append(estimate.estimate(motion))
        except (estimate.NoEstimate, np.linalg.LinAlgError) as error:
            found.append(error)
    return found


def main():
    sys.path.insert(0, f"{sys.argv[1]}/identify")
    first, last = map(int, sys.argv[3].split(":")) if len(sys.argv) > 3 else (0, 100)
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    import estimate
    arms = emulated.draw(last, seed)[first:]
    count = len(arms)
    found = identify_all(emulated.library(sys.argv[2]), arms)
    inside, relative, modes, missed_modes, bounds = [], [], [], 0, []
    print(" n   mass g      f N    b/m  delay  q um  mode |  mass%  b%    f%   delay  mode% | inside bound% unexplained white spoilt slips")
    for n, (arm, e) in enumerate(zip(arms, found)):
        t = truth_of(arm)
        true_mode = arm["mode"] / 2 / np.pi
        head = (f"{n:3} {np.cbrt(np.linalg.det(arm['mass'])) * 1e3:7.1f} {arm['coulomb'].mean():8.3f} "
                f"{(arm['viscous'] / np.diag(arm['mass'])).mean():6.1f} {arm['delay']:6.2f} {arm['quantum'][0] * 1e6:5.0f} {true_mode:5.0f} |")
        if isinstance(e, Exception):
            print(head, "none:", e)
            continue
        within = (e.low <= t) & (t <= e.high)
        within[15:18] = True  # springs, of which the arms have none, are no part of the claim
        inside.append(within)
        off = np.abs(e.values - t) / np.maximum(np.abs(t), 1e-12)
        off[3:6] = np.abs(e.values[3:6] - t[3:6]) / np.sqrt([t[0] * t[1], t[0] * t[2], t[1] * t[2]])
        off[15:18] = 0
        off[18] = abs(e.values[18] - t[18])
        relative.append(off)
        found_mode = e.mode.hz if e.mode else 0.0
        if true_mode > 0 and e.mode:
            modes.append((abs(e.mode.hz / true_mode - 1), e.mode.low_hz <= true_mode <= e.mode.high_hz))
        elif true_mode > 0 or e.mode:
            missed_modes += 1
        t_d = 0.0005 + arm["delay"] * 0.001
        damping = min(2.0, 0.2 * np.min(np.diag(arm["mass"])) / t_d)
        true_k = boundary.of_axes(arm["mass"], arm["viscous"], arm["delay"], 0.001, damping)
        k = np.nan
        if np.all(np.linalg.eigvalsh(e.mass_kg) > 0):
            k = boundary.of_axes(e.mass_kg, e.values[6:9], max(e.values[18], 0), 0.001, damping)
        bounds.append(k / true_k - 1)
        print(head, f"{100 * off[:6].max():6.2f} {100 * off[6:9].max():6.1f} {100 * off[9:12].max():5.1f} {off[18]:6.3f} {found_mode:6.1f} | "
              f"{within.sum():2}/19 {100 * bounds[-1]:6.1f} {100 * e.unexplained:6.2f}% {np.min(e.whiteness):.3f} {len(e.spoilt)} {len(e.slips)}",
              "not in: " + " ".join(estimate.NAMES[m].replace("coulomb", "f").replace("viscous", "b").replace("mass_", "m") for m in np.flatnonzero(~within)))
    inside, relative, bounds = np.array(inside), np.array(relative), np.array(bounds)
    print(f"{len(inside)} of {count} identified")
    for name, part in (("mass", slice(0, 6)), ("viscous", slice(6, 9)), ("coulomb", slice(9, 12)), ("weight", slice(12, 15)), ("delay", slice(18, 19))):
        print(f"{name:8} median error {100 * np.median(relative[:, part]):6.2f} {'%' if name != 'delay' else '% of a period'}; "
              f"inside of the interval in {100 * inside[:, part].mean():.0f} %, by parameter {100 * inside[:, part].mean(axis=0)}")
    if modes:
        print(f"mode     median error {100 * np.median([m[0] for m in modes]):6.2f} %; inside {100 * np.mean([m[1] for m in modes]):.0f} % of {len(modes)}; "
              f"found without, or missed: {missed_modes}")
    print(f"boundary within 10 % in {np.sum(np.abs(bounds) < 0.1)} of {count}")


if __name__ == "__main__":
    main()
