# SPDX-License-Identifier: Apache-2.0
"""The plot of a recording (`kerf record plot`, forces.svg of a demo), and of a run beside its replay. JSON of the first:

    end_s                       end of the time axis
    curves, sources             lists of {name, s, values}: times in s with the values there. Curves are contact,
                                modification and commanded (N), penetration (mm), removed (density over full, mm3) and port (mJ), and with two
                                arms commanded_2 and penetration_2 of the second; sources
                                are those of energy that did any work (mJ)"""
import figure as fig

SOURCES = {"spring": fig.BLUE, "damping": fig.GREEN, "friction": fig.RED, "cutting": fig.PINK, "limits": fig.YELLOW,
           "hold": fig.GREY, "leak": fig.SKY, "stabiliser": fig.BROWN}


def forces(data):
    curves = {curve["name"]: curve for curve in data["curves"]}
    picture, ((force,), (depth,), (work,)) = fig.new_figure(960, 920, rows=3, left=80, right=80, top=40, down=50, bottom=50)

    def draw(axes, name, colour, label, width=1.5):
        return axes.plot(curves[name]["s"], curves[name]["values"], color=colour, label=label, linewidth=width)[0]

    # The commanded force lies broad under the contact force that it mostly follows.
    draw(force, "commanded", fig.ORANGE, "commanded", 3.2)
    draw(force, "contact", fig.BLUE, "contact")
    draw(force, "modification", fig.GREEN, "modification")
    if "commanded_2" in curves:
        draw(force, "commanded_2", fig.RED, "commanded, second arm")
    force.set_ylabel("force (N)")
    lines = [draw(depth, "penetration", fig.BLUE, "penetration")]
    if "penetration_2" in curves:
        lines.append(draw(depth, "penetration_2", fig.GREEN, "penetration, second arm"))
    depth.set_ylabel("penetration (mm)")
    removed = depth.twinx()
    removed.spines["right"].set_visible(True)
    lines.append(draw(removed, "removed", fig.RED, "removed density", 1.8))
    removed.set_ylabel("removed (mm³)")
    for axes in (force, depth, removed):
        low, high = axes.dataLim.intervaly
        axes.set_ylim(min(0, low), max(high, 0.01) * 1.05)
    work.axhline(0, color=fig.FRAME, linewidth=0.8)
    draw(work, "port", fig.ORANGE, "all", 3.2)
    for source in data["sources"]:
        work.plot(source["s"], source["values"], label=source["name"], color=SOURCES.get(source["name"], fig.BLACK))
    work.set_ylabel("work of the hand (mJ)")
    work.set_xlabel("time (s)")
    for axes, handles in ((force, None), (depth, lines), (work, None)):
        axes.set_xlim(0, data["end_s"])
        axes.grid(True)
        handles = handles or axes.get_legend_handles_labels()[0]
        axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(-0.01, 0.99), ncol=len(handles), columnspacing=1.6)
    force.tick_params(labelbottom=False)
    depth.tick_params(labelbottom=False)
    return fig.svg(picture)


def replay(data):
    """JSON: end_s, and curves by name as above: recorded_n and replayed_n, apart_mm, recorded_mm3 and replayed_mm3."""
    curves = {curve["name"]: curve for curve in data["curves"]}
    picture, ((force,), (place,), (removed,)) = fig.new_figure(960, 920, rows=3, left=80, right=80, top=40, down=50,
                                                               bottom=50)

    def draw(axes, name, colour, label, width):
        axes.plot(curves[name]["s"], curves[name]["values"], color=colour, label=label, linewidth=width)

    for axes, unit in ((force, "n"), (removed, "mm3")):
        draw(axes, "recorded_" + unit, fig.ORANGE, "recorded", 3.2)
        draw(axes, "replayed_" + unit, fig.BLUE, "replayed", 1.5)
    draw(place, "apart_mm", fig.GREEN, "between both places", 1.5)
    force.set_ylabel("commanded force (N)")
    place.set_ylabel("tool apart (mm)")
    removed.set_ylabel("removed (mm³)")
    removed.set_xlabel("time (s)")
    for axes in (force, place, removed):
        axes.set_xlim(0, data["end_s"])
        axes.set_ylim(min(0, axes.dataLim.intervaly[0]), max(axes.dataLim.intervaly[1], 0.01) * 1.05)
        axes.grid(True)
        axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 0.99), ncol=2, columnspacing=1.6)
    force.tick_params(labelbottom=False)
    place.tick_params(labelbottom=False)
    return fig.svg(picture)
