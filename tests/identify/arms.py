# SPDX-License-Identifier: Apache-2.0
"""Emulated arms with hidden values, and the experiment on all of them at once. The estimator gets the Motion alone."""
import ctypes

import numpy as np

PERIOD_S = 0.001
LIMIT_N = 3.0

ARM = np.dtype([("mass", "f8", (3, 3)), ("inverse", "f8", (3, 3)), ("viscous", "f8", 3), ("coulomb", "f8", 3), ("weight", "f8", 3),
                ("static_ratio", "f8"), ("stribeck", "f8"), ("quantum", "f8", 3), ("shift", "f8", 3), ("delay", "f8"), ("mode", "f8"),
                ("motor_ratio", "f8"), ("damping_ratio", "f8"), ("place", "f8", 3), ("speed", "f8", 3), ("behind", "f8", 3),
                ("behind_speed", "f8", 3), ("asked", "f8", (16, 3)), ("impulse", "f8", 3), ("tick", "i8")])


def log_uniform(random, low, high, size=None):
    return np.exp(random.uniform(np.log(low), np.log(high), size))


def draw(count, seed):
    """Arms of the ranges that the issue of identification has: 5 g to 2 kg, anisotropic by up to 2.5 and turned, friction of 0.02 to
    1 N, delay of 0 to 3 periods, quantum of 2 to 100 um, every second one with a mode; every third with a static friction above."""
    random = np.random.Generator(np.random.PCG64(seed))
    arms = np.zeros(count, ARM)
    for n, arm in enumerate(arms):
        heaviest = log_uniform(random, 0.005 * 2.5, 2.0)
        principal = heaviest / np.array([1.0, random.uniform(1, 2.5), random.uniform(1, 2.5)])
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        arm["mass"] = turn @ np.diag(principal) @ turn.T
        arm["viscous"] = log_uniform(random, 1.0, 20.0) * np.exp(np.mean(np.log(principal))) * random.uniform(0.7, 1.3, 3)
        arm["coulomb"] = np.clip(log_uniform(random, 0.02, 1.0) * random.uniform(0.7, 1.3, 3), 0.02, 1.0)
        arm["weight"] = random.uniform(-0.05, 0.05, 3)
        arm["static_ratio"], arm["stribeck"] = (1.15 if n % 3 == 2 else 1.0), 0.002
        arm["quantum"] = log_uniform(random, 2e-6, 100e-6)
        arm["shift"] = random.uniform(0, 1, 3) * arm["quantum"]
        arm["delay"] = random.uniform(0, 3)
        arm["motor_ratio"] = 1.0
        mode, ratio, damping = 2 * np.pi * log_uniform(random, 60, 250), random.uniform(0.35, 0.75), log_uniform(random, 0.01, 0.05)
        if n % 2:
            arm["mode"], arm["motor_ratio"], arm["damping_ratio"] = mode, ratio, damping
        arm["inverse"] = np.linalg.inv(arm["mass"] * arm["motor_ratio"])
    return arms


def library(path):
    lib = ctypes.CDLL(path)
    lib.arm_bytes.restype = ctypes.c_size_t
    assert lib.arm_bytes() == ARM.itemsize
    return lib


def run(lib, arms, experiment, seconds, touch=None):
    """Places (ticks, arms, 3) in m and forces in N. touch(arms, tick, shown): what else happens to them."""
    arms = arms.copy()
    n, ticks = len(arms), int(round(seconds / PERIOD_S))
    places, forces = np.zeros((ticks, n, 3)), np.zeros((ticks, n, 3))
    shown = np.floor((arms["place"] + arms["shift"]) / arms["quantum"]) * arms["quantum"]
    shown = np.ascontiguousarray(shown)
    speed, before = np.zeros((n, 3)), shown.copy()
    for tick in range(ticks):
        places[tick] = shown
        speed += 0.2 * ((shown - before) / PERIOD_S - speed)
        before = shown.copy()
        force, goal, stiffness, damping = experiment.ask(tick * PERIOD_S, shown * 1000)
        sent = force + stiffness * (goal - shown * 1000) - damping * speed * 1000
        whole = np.linalg.norm(sent, axis=1, keepdims=True)
        sent = np.ascontiguousarray(sent * np.minimum(1, LIMIT_N / np.maximum(whole, 1e-12)))
        if touch is not None:
            touch(arms, tick, sent)
        forces[tick] = sent
        lib.arms_tick(arms.ctypes.data_as(ctypes.c_void_p), n, sent.ctypes.data_as(ctypes.c_void_p), ctypes.c_double(PERIOD_S),
                      shown.ctypes.data_as(ctypes.c_void_p))
    return places, forces
