# SPDX-License-Identifier: Apache-2.0
"""The sheet of burs (`kerf studies burs --svg`): every head from the side at the sizes that are sold most, all at one scale. JSON:

    out_mm                      length of head and neck that a scene has out of the handpiece
    heads                       {number, name, sizes}: sizes {tenths, neck_mm, length_mm, outline}: diameter in 0.1 mm, radius of
                                the neck, length of the head, and its outline as [radius, height over the tip] in mm"""
import text

PER_MM, COLUMN, ROW, LEFT, TOP = 14, 62, 176, 150, 40  # pixels


def sheet(data):
    import figure as fig
    from matplotlib.patches import Polygon, Rectangle
    heads = text.rows_of(data, "heads")
    columns = {size["tenths"]: None for head in heads for size in head["sizes"]}
    width, height = LEFT + COLUMN * len(columns), TOP + ROW * len(heads)
    picture, ((axes,),) = fig.new_figure(width, height, left=0, right=0, top=0, bottom=0)
    axes.set_axis_off()
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    axes.text(12, 24, 'Head and diameter in 0.1 mm, as bur = "001 014"', fontsize=10.5)
    for row, head in enumerate(heads):
        tip = TOP + ROW * (row + 1) - 40
        axes.text(12, tip - 50, head["number"], fontsize=10.5, fontweight="bold")
        axes.text(12, tip - 30, head["name"], fontsize=10.5)
        for size in head["sizes"]:
            x = LEFT + COLUMN * (sorted(columns).index(size["tenths"]) + 0.5)
            neck = PER_MM * size["neck_mm"]
            axes.add_patch(Rectangle((x - neck, tip - PER_MM * data["out_mm"]), 2 * neck,
                                     PER_MM * (data["out_mm"] - size["length_mm"] / 2), facecolor="#B9BEC4"))
            side = [(PER_MM * radius, tip - PER_MM * up) for radius, up in size["outline"]]
            axes.add_patch(Polygon([(x + across, y) for across, y in side] + [(x - across, y) for across, y in reversed(side)],
                                   facecolor="#5F6B78", edgecolor="#2B333B", linewidth=0.8))
            axes.text(x, tip + 18, f"{size['tenths']:03d}", fontsize=9, ha="center")
    return fig.svg(picture)
