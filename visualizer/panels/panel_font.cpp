// SPDX-License-Identifier: Apache-2.0
#include "visualizer/panels/panel_font.hpp"

#include <array>

// The file as it is, 0.7 MB: C++20 has no other way to take it in that compiles within a second.
asm(".pushsection .rodata\n"
    ".balign 16\n"
    ".globl kerf_panel_font\n"
    "kerf_panel_font: .incbin \"" KERF_PANEL_FONT
    "\"\n"
    ".globl kerf_panel_font_end\n"
    "kerf_panel_font_end: .byte 0\n"
    ".popsection\n");
extern "C" const unsigned char kPanelFont[] asm("kerf_panel_font"), kPanelFontEnd[] asm(
                                                                        "kerf_panel_font_end");

namespace kerf {

void load_panel_font(ImFontAtlas& fonts, float pixels) {
  static constexpr std::array<ImWchar, 3> kLatin{0x20, 0x24f, 0};
  ImFontConfig config;
  config.FontDataOwnedByAtlas = false;
  config.OversampleH = config.OversampleV = 1;  // sharper than blends of positions between pixels,
  config.PixelSnapH = true;                     // which no letter takes then
  fonts.Clear();
  // ImGui takes a pointer to what it may own, and does not write to it.
  fonts.AddFontFromMemoryTTF(const_cast<unsigned char*>(kPanelFont),
                             static_cast<int>(kPanelFontEnd - kPanelFont), pixels, &config,
                             kLatin.data());
}

}  // namespace kerf
