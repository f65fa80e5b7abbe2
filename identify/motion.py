# SPDX-License-Identifier: Apache-2.0
"""Speed and direction of a tip from a log, by a model of the arm: what the positions alone say too late.

A smoothed difference shifts each reversal, since friction bends the speed there. So the model's motion is taken first, and only
what the log differs by is smoothed: that is nearly straight over a window."""
import numpy as np


def slope(signal, half, period_s):
    """Of the parabola through 2 half + 1 samples, at their middle (Savitzky and Golay 1964); the ends repeat."""
    k = np.arange(-half, half + 1)
    kernel = k / (k @ k) / period_s
    padded = np.pad(signal, [(half, half)] + [(0, 0)] * (signal.ndim - 1), mode="edge")
    views = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0)
    return views @ kernel


def acting_force(force, delay):
    """Mean force of the period behind each tick, and its share in the way of that period (in periods squared)."""
    whole = int(np.floor(delay))
    part = delay - whole
    def shifted(by):
        return np.concatenate([np.repeat(force[:1], by, axis=0), force[:len(force) - by]]) if by else force
    new, old = shifted(whole), shifted(whole + 1)
    mean = part * old + (1 - part) * new
    way = old * (part - part**2 / 2) + new * (1 - part)**2 / 2
    return mean, way


def directions(speed):
    """Mean of the sign of each axis' speed over the period behind each tick, and around each tick, with the moment of each
    reversal by a straight line between two ticks."""
    a, b = speed[:-1], speed[1:]
    turns = a * b < 0
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where(turns, a / (a - b), 1.0)
    behind = np.where(turns, np.sign(a) * at + np.sign(b) * (1 - at), np.sign(a + b))
    behind = np.concatenate([behind, behind[-1:]])
    # Half a period to both sides: the line's halves.
    first = np.where(turns, np.sign(a) * np.minimum(2 * at, 1) + np.sign(b) * np.maximum(1 - 2 * at, 0), np.sign(a + b))
    last = 2 * behind[:-1] - first
    around = behind.copy()
    around[1:-1] = (last[:-1] + first[1:]) / 2
    return behind, around


def modal(acceleration, w, damping_ratio, period_s):
    """Place and speed of an oscillator under an acceleration that is held over each period: by its step response."""
    t = np.arange(len(acceleration) + 1) * period_s
    fall, damped = np.exp(-damping_ratio * w * t), w * np.sqrt(1 - damping_ratio**2)
    place = (1 - fall * (np.cos(damped * t) + damping_ratio * w / damped * np.sin(damped * t))) / w**2
    speed = fall * np.sin(damped * t) / damped
    size = 2 * len(acceleration)
    held = np.fft.rfft(acceleration, size, axis=0)
    def answer(step):
        kernel = np.fft.rfft(np.concatenate([[0.0], np.diff(step)])[:len(acceleration)], size)
        return np.fft.irfft(held * kernel[:, None], size, axis=0)[:len(acceleration)]
    return answer(place), answer(speed)


def model_speed(place, acceleration, way, half, period_s, swing=None):
    """Speed at each tick from the model's acceleration (mean of the period behind each tick; `way`: twice integrated over it),
    held to the positions by the slope of the difference over 2 half + 1 ticks. swing: place and speed of a mode on top."""
    gain = acceleration * period_s
    speed = np.concatenate([np.zeros((1, 3)), np.cumsum(gain[:-1], axis=0)])
    step = speed[:-1] * period_s + way[:-1]
    modelled = np.concatenate([np.zeros((1, 3)), np.cumsum(step, axis=0)])
    if swing is not None:
        modelled, speed = modelled + swing[0], speed + swing[1]
    return speed + slope(place - modelled, half, period_s)
