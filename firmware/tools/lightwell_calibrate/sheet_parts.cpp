#include "tools/lightwell_calibrate/sheet_parts.hpp"

#include <algorithm>
#include <cstdint>

#include <lightwell/text.hpp>

namespace lightwell::calibrate {

Result<Paper> find_paper(std::string_view name) {
  const auto paper = std::find_if(kPapers.begin(), kPapers.end(), [&](const Paper& p) { return p.name == name; });
  if (paper != kPapers.end()) return *paper;
  return Status(StatusCode::invalid_argument, "'" + std::string(name) + "' is not known; a4, a3 and letter are");
}

std::string brief(double value) { return formatted("%.4g", value); }

std::vector<Rectangle> tag_rectangles(const TagBitmap& tag, double left, double top, double cell) {
  std::vector<Rectangle> out;
  for (int row = 0; row < tag.cells; ++row)
    for (int column = 0; column < tag.cells;) {
      int end = column;
      while (end < tag.cells && tag.is_dark(end, row)) ++end;
      if (end > column) out.push_back({left + column * cell, top + row * cell, (end - column) * cell, cell});
      column = end + 1;
    }
  return out;
}

void draw_ruler(double x, double y, Page& page) {
  constexpr double kThin = 0.15;
  std::vector<Rectangle> lines = {{x, y, kRulerLength_mm, kThin}};
  // The left side of a stroke is at its position; of the last stroke the right side.
  for (int mm = 0; mm <= static_cast<int>(kRulerLength_mm); ++mm) {
    const double stroke_height = mm % 10 == 0 ? 3.2 : mm % 5 == 0 ? 2.2 : 1.4;
    // Millimetre strokes in the first and the last centimetre only.
    if (mm > 10 && mm < kRulerLength_mm - 10 && mm % 5 != 0) continue;
    lines.push_back(
        {x + mm - (mm == static_cast<int>(kRulerLength_mm) ? kThin : 0), y - stroke_height, kThin, stroke_height});
  }
  page.shapes.push_back(std::move(lines));
  for (int mm = 0; mm <= static_cast<int>(kRulerLength_mm); mm += 50)
    page.texts.push_back(
        {std::to_string(mm) + (mm == static_cast<int>(kRulerLength_mm) ? " mm" : ""), x + mm + 0.8, y - 3.6, 2.4});
}

std::vector<Rectangle> digits(int number, double width, double height) {
  // Segments top, upper right, lower right, bottom, lower left, upper left, middle are bits 0 to 6.
  static constexpr std::array<std::uint8_t, 10> kBars = {0x3f, 0x06, 0x5b, 0x4f, 0x66, 0x6d, 0x7d, 0x07, 0x7f, 0x6f};
  const std::string text = std::to_string(number);
  const auto count = static_cast<double>(text.size());
  // A digit is half as wide as high, a gap half as wide as a digit; the underline needs three more bar widths.
  const double high = std::min(height * 9 / 12, width / (0.5 * count + 0.25 * (count - 1)));
  const double wide = high / 2, bar = high / 9, pitch = 1.5 * wide;
  std::vector<Rectangle> out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const double x = (static_cast<double>(i) - (count - 1) / 2) * pitch - wide / 2, y = -high / 2, half = high / 2;
    // Vertical bars end where horizontal ones begin, so that none overlap.
    const double tall = half - 1.5 * bar;
    const std::array<Rectangle, 7> bars = {{{x, y, wide, bar},
                                            {x + wide - bar, y + bar, bar, tall},
                                            {x + wide - bar, y + half + bar / 2, bar, tall},
                                            {x, y + high - bar, wide, bar},
                                            {x, y + half + bar / 2, bar, tall},
                                            {x, y + bar, bar, tall},
                                            {x, y + half - bar / 2, wide, bar}}};
    const std::uint8_t lit = kBars[static_cast<std::size_t>(text[i] - '0')];
    for (std::size_t k = 0; k < bars.size(); ++k)
      if ((lit >> k) & 1) out.push_back(bars[k]);
  }
  const double across = pitch * (count - 1) + wide;
  out.push_back({-across / 2, high / 2 + 2 * bar, across, bar});
  for (Rectangle& r : out) r.y -= 1.5 * bar;
  return out;
}

}  // namespace lightwell::calibrate
