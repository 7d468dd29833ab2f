#include "tools/lightwell_calibrate/sheets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <lightwell/text.hpp>

#include "imaging/image_file.hpp"
#include "tools/command_line.hpp"

namespace lightwell::calibrate {

namespace {

constexpr double kPointsPerMm = 72 / 25.4;

/// Decimals without exponent, which PDF and old SVG readers do not support. The resolution of 1e-5 pt is 4 nm.
std::string number(double value) {
  std::string out = formatted("%.5f", value);
  out.erase(out.find_last_not_of('0') + 1);
  if (out.back() == '.') out.pop_back();
  return out == "-0" ? "0" : out;
}

std::string escaped_pdf(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '(' || c == ')' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string escaped_xml(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

std::string content_of(const Page& page) {
  // In PDF, y increases upwards (ISO 32000-1, 8.3.2.3).
  const auto y = [&](double mm) { return number((page.height - mm) * kPointsPerMm); };
  const auto x = [](double mm) { return number(mm * kPointsPerMm); };
  std::string content;
  for (const PageArea& area : page.areas) {
    content += number(area.grey) + " g\n";
    for (const auto& outline : area.outlines) {
      for (std::size_t i = 0; i < outline.size(); ++i)
        content += x(outline[i].x) + " " + y(outline[i].y) + (i == 0 ? " m " : " l ");
      content += "h\n";
    }
    content += "f\n";
  }
  content += "0 g\n";
  for (const PageText& t : page.texts)
    content += "BT /F1 " + x(t.size) + " Tf " + x(t.x) + " " + y(t.y) + " Td (" + escaped_pdf(t.text) + ") Tj ET\n";
  return content;
}

/// A grey as "#808080".
std::string hexadecimal(double grey) {
  const auto value = static_cast<unsigned>(std::lround(255 * std::clamp(grey, 0.0, 1.0)));
  return formatted("#%02x%02x%02x", value, value, value);
}

/// Adds the part of an edge within one row, of signed `height`, from x0 to x1. Accumulates the derivative along the row
/// of the area to the right of the edge, so that a running sum gives the coverage.
void add_in_row(float* row, double x0, double x1, double height) {
  if (x0 > x1) std::swap(x0, x1);
  const double inclined = x1 - x0;
  const int first = static_cast<int>(std::floor(x0)), last = static_cast<int>(std::floor(x1));
  double before = 0;
  for (int i = first; i <= last; ++i) {
    const double from = std::max(x0, static_cast<double>(i)), to = std::min(x1, i + 1.0);
    const double part = inclined > 0 ? height * (to - from) / inclined : height;
    const double right_of_it = part * (i + 1 - (from + to) / 2);
    row[i] += static_cast<float>(before + right_of_it);
    before = part - right_of_it;
  }
  row[last + 1] += static_cast<float>(before);
}

/// Unprintable margin, and space for text and ruler below the board, mm.
constexpr double kEdge = kPrinterMargin_mm, kFooter = 20;

/// Extent of the print beyond the detected corners, relative to the tag's size.
double outside(TagFamily family) {
  const TagShape shape = shape_of(family);
  return (shape.cells - shape.edge_cells) / 2.0 / shape.edge_cells;
}

/// Width and height of the whole print in units of the tag's size.
std::pair<double, double> extent(const TagBoard& board) {
  const double more = 1 + 2 * outside(board.family);
  return {(board.columns - 1) * (1 + board.spacing) + more, (board.rows - 1) * (1 + board.spacing) + more};
}

}  // namespace

PageArea black_area(std::span<const Rectangle> rectangles) {
  PageArea out;
  for (const Rectangle& r : rectangles)
    out.outlines.push_back({{r.x, r.y}, {r.x + r.width, r.y}, {r.x + r.width, r.y + r.height}, {r.x, r.y + r.height}});
  return out;
}

Coverage coverage_of(const std::vector<std::vector<PagePoint>>& outlines, double scale) {
  double x_min = std::numeric_limits<double>::max(), x_max = -x_min, y_min = x_min, y_max = -x_min;
  for (const auto& outline : outlines)
    for (const PagePoint& p : outline) {
      x_min = std::min(x_min, p.x * scale), x_max = std::max(x_max, p.x * scale);
      y_min = std::min(y_min, p.y * scale), y_max = std::max(y_max, p.y * scale);
    }
  Coverage out;
  if (!(x_min <= x_max)) return out;
  out.left = static_cast<int>(std::floor(x_min)), out.top = static_cast<int>(std::floor(y_min));
  // One more pixel on the right for the carry of an edge's last pixel, and one for rounding.
  out.width = static_cast<int>(std::floor(x_max)) - out.left + 3;
  out.height = static_cast<int>(std::floor(y_max)) - out.top + 1;
  out.share.assign(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height), 0.0F);
  for (const auto& outline : outlines)
    for (std::size_t i = 0; i < outline.size(); ++i) {
      PagePoint p{outline[i].x * scale - out.left, outline[i].y * scale - out.top};
      const PagePoint& next = outline[(i + 1) % outline.size()];
      PagePoint q{next.x * scale - out.left, next.y * scale - out.top};
      if (p.y == q.y) continue;
      const double sign = p.y < q.y ? 1 : -1;
      if (sign < 0) std::swap(p, q);
      const double slope = (q.x - p.x) / (q.y - p.y);
      const auto x_at = [&](double y) {
        return std::clamp(p.x + slope * (y - p.y), std::min(p.x, q.x), std::max(p.x, q.x));
      };
      for (int y = static_cast<int>(p.y); y < out.height && y < q.y; ++y) {
        const double from = std::max(p.y, static_cast<double>(y)), to = std::min(q.y, y + 1.0);
        if (to > from)
          add_in_row(&out.share[static_cast<std::size_t>(y * out.width)], x_at(from), x_at(to), sign * (to - from));
      }
    }
  for (int y = 0; y < out.height; ++y) {
    float sum = 0;
    for (int x = 0; x < out.width; ++x) {
      float& share = out.share[static_cast<std::size_t>(y * out.width + x)];
      sum += share;
      share = std::min(1.0F, std::abs(sum));
    }
  }
  return out;
}

std::string pages_to_pdf(std::span<const Page> pages) {
  // Objects: 1 the catalog, 2 the page tree, 3 the font, then each page and its content stream.
  std::vector<std::string> objects(3);
  std::string kids;
  for (const Page& page : pages) {
    const std::size_t number_of_page = objects.size() + 1;
    const std::string content = content_of(page);
    kids += (kids.empty() ? "" : " ") + std::to_string(number_of_page) + " 0 R";
    objects.push_back("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 " + number(page.width * kPointsPerMm) + " " +
                      number(page.height * kPointsPerMm) + "] /Contents " + std::to_string(number_of_page + 1) +
                      " 0 R /Resources << /Font << /F1 3 0 R >> >> >>");
    objects.push_back("<< /Length " + std::to_string(content.size()) + " >>\nstream\n" + content + "endstream");
  }
  objects[0] = "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>";
  objects[1] = "<< /Type /Pages /Kids [" + kids + "] /Count " + std::to_string(pages.size()) + " >>";
  objects[2] = "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>";
  std::string out = "%PDF-1.6\n%\xE2\xE3\xCF\xD3\n";
  std::string table = "0000000000 65535 f \n";
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += formatted("%010zu 00000 n \n", out.size());
    out += std::to_string(i + 1) + " 0 obj\n" + objects[i] + "\nendobj\n";
  }
  const std::size_t start = out.size();
  const std::string size = std::to_string(objects.size() + 1);
  out += "xref\n0 " + size + "\n" + table + "trailer\n<< /Size " + size + " /Root 1 0 R >>\nstartxref\n" +
         std::to_string(start) + "\n%%EOF\n";
  return out;
}

std::string page_to_svg(const Page& page) {
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(page.width) + "mm\" height=\"" +
                    number(page.height) + "mm\" viewBox=\"0 0 " + number(page.width) + " " + number(page.height) +
                    "\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n";
  for (const PageArea& area : page.areas) {
    out += "<path fill=\"" + hexadecimal(area.grey) + "\" d=\"";
    for (const auto& outline : area.outlines) {
      for (std::size_t i = 0; i < outline.size(); ++i)
        out += (i == 0 ? "M" : "L") + number(outline[i].x) + " " + number(outline[i].y);
      out += "z";
    }
    out += "\"/>\n";
  }
  for (const PageText& t : page.texts)
    out += "<text x=\"" + number(t.x) + "\" y=\"" + number(t.y) + "\" font-size=\"" + number(t.size) +
           "\" font-family=\"Helvetica, Arial, sans-serif\">" + escaped_xml(t.text) + "</text>\n";
  return out + "</svg>\n";
}

Status write_page_png(const Page& page, double dots_per_inch, const std::string& path) {
  constexpr double kMaxPixels = 64e6;
  const double scale = dots_per_inch / 25.4;
  const double wide = std::round(page.width * scale), high = std::round(page.height * scale);
  if (!(wide >= 1 && high >= 1 && wide * high <= kMaxPixels))
    return {StatusCode::resource_exhausted, path + ": " + number(dots_per_inch) + " dots an inch make " + number(wide) +
                                                "x" + number(high) + " pixels; at most 64 megapixels are written"};
  const int width = static_cast<int>(wide), height = static_cast<int>(high);
  cv::Mat light(height, width, CV_32F, cv::Scalar(1));
  for (const PageArea& area : page.areas) {
    const Coverage covered = coverage_of(area.outlines, scale);
    for (int y = std::max(0, -covered.top); y < std::min(covered.height, height - covered.top); ++y)
      for (int x = std::max(0, -covered.left); x < std::min(covered.width, width - covered.left); ++x) {
        float& pixel = light.at<float>(covered.top + y, covered.left + x);
        pixel += covered.at(x, y) * (static_cast<float>(area.grey) - pixel);
      }
  }
  cv::Mat grey;
  light.convertTo(grey, CV_8U, 255);
  for (const PageText& t : page.texts) {
    // Capitals have 21 px at scale 1 in OpenCV's font, and 0.72 em in Helvetica.
    const double letters = t.size * scale * 0.72 / 21;
    cv::putText(grey, t.text, {static_cast<int>(t.x * scale), static_cast<int>(t.y * scale)}, cv::FONT_HERSHEY_SIMPLEX,
                letters, cv::Scalar(0), std::max(1, static_cast<int>(std::lround(1.5 * letters))), cv::LINE_AA);
  }
  Image image;
  image.width = width;
  image.height = height;
  image.data.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.data.insert(image.data.end(), 3, std::byte{grey.at<std::uint8_t>(y, x)});
  return write_png(path, image);
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
  constexpr int kEnd = static_cast<int>(kRulerLength_mm);
  std::vector<Rectangle> lines = {{x, y, kRulerLength_mm, kThin}};
  for (int mm = 0; mm <= kEnd; ++mm) {
    if (mm % 50 == 0)
      page.texts.push_back({std::to_string(mm) + (mm == kEnd ? " mm" : ""), x + mm + 0.8, y - 3.6, 2.4});
    // Millimetre strokes in the first and the last centimetre only.
    if (mm > 10 && mm < kEnd - 10 && mm % 5 != 0) continue;
    const double height = mm % 10 == 0 ? 3.2 : mm % 5 == 0 ? 2.2 : 1.4;
    // The left side of a stroke is at its position; of the last stroke the right side.
    lines.push_back({x + mm - (mm == kEnd ? kThin : 0), y - height, kThin, height});
  }
  page.areas.push_back(black_area(lines));
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

Result<BoardPage> layout(const TagBoard& board, const Paper& paper) {
  const double tag = 1000 * board.tag_size_m;
  const auto [across, upwards] = extent(board);
  double largest = 0;
  for (const bool turned : {false, true}) {
    const double width = turned ? paper.height_mm : paper.width_mm, height = turned ? paper.width_mm : paper.height_mm;
    const double room_x = width - 2 * kEdge, room_y = height - 2 * kEdge - kFooter;
    largest = std::max(largest, std::min(room_x / across, room_y / upwards));
    if (tag * across > room_x || tag * upwards > room_y) continue;
    BoardPage out;
    out.landscape = turned;
    Page& page = out.page;
    page.width = width;
    page.height = height;
    const double beyond = outside(board.family) * tag;
    out.origin_x_mm = kEdge + (room_x - tag * across) / 2 + beyond;
    out.origin_y_mm = kEdge + (room_y - tag * upwards) / 2 + tag * upwards - beyond;
    const double cell = tag / shape_of(board.family).edge_cells;
    for (int id = board.first_id; id < board.first_id + board.tags(); ++id) {
      const Result<TagBitmap> bitmap = tag_bitmap(board.family, id);
      if (!bitmap) return bitmap.status();
      const Vec3d top_left = board.corners(id)[3];
      page.areas.push_back(black_area(tag_rectangles(*bitmap, out.origin_x_mm + 1000 * top_left.x - beyond,
                                                     out.origin_y_mm - 1000 * top_left.y - beyond, cell)));
    }
    const double foot = height - kEdge - kFooter;
    page.texts.push_back(
        {formatted("Lightwell board: %s, %d x %d tags, numbers %d to %d from the bottom left, tag %.4g mm, "
                   "gap %.4g mm (spacing %.4g).",
                   std::string(to_string(board.family)).c_str(), board.columns, board.rows, board.first_id,
                   board.first_id + board.tags() - 1, tag, tag * board.spacing, board.spacing),
         kEdge + 2, foot + 5, 2.6});
    page.texts.push_back({formatted("Print at 100 %% (\"actual size\") on matt paper and glue it onto something flat. "
                                    "Corner to corner %.4g x %.4g mm: measure both ways.",
                                    1000 * board.width_m(), 1000 * board.height_m()),
                          kEdge + 2, foot + 9, 2.6});
    draw_ruler(kEdge + 2, foot + 18.5, page);
    return out;
  }
  return invalid_argument(
      formatted("the board is %.4g x %.4g mm with its rim and does not fit %s; --tag-size-mm %.4g would, or fewer "
                "--columns and --rows, or larger --paper",
                tag * across, tag * upwards, std::string(paper.name).c_str(), std::floor(largest * 10) / 10));
}

void add_sheet_options(CLI::App& app, SheetOptions& options, const std::vector<std::string>& endings,
                       const std::string& dpi_help, const std::string& output_help, const std::string& json_help) {
  app.add_option("--dpi", options.dpi, dpi_help)->check(number_where("from 36 to 2400", [](double dpi) {
    return dpi >= 36 && dpi <= 2400;
  }));
  const auto check_output = [endings](const std::string& path) {
    if (std::ranges::any_of(endings, [&](const std::string& ending) { return path.ends_with(ending); }))
      return std::string();
    const std::string others = joined(std::span(endings).first(endings.size() - 1));
    return "'" + path + "' must end in " + others + " or " + endings.back();
  };
  app.add_option("--output", options.outputs, output_help)
      ->type_name("FILE")
      ->allow_extra_args(false)
      ->check(check_output);
  app.add_flag("--json", options.json, json_help);
}

Status write_pages(std::span<const Page> pages, const std::string& path, double dpi, std::vector<std::string>& files) {
  if (path.ends_with(".pdf")) {
    files.push_back(path);
    return write_output(path, pages_to_pdf(pages));
  }
  for (std::size_t i = 0; i < pages.size(); ++i) {
    const std::string number = pages.size() == 1 ? "" : "-" + std::to_string(i + 1);
    files.push_back(path.substr(0, path.size() - 4) + number + path.substr(path.size() - 4));
    const Status s = path.ends_with(".png") ? write_page_png(pages[i], dpi, files.back())
                                            : write_output(files.back(), page_to_svg(pages[i]));
    if (!s.ok()) return s;
  }
  return {};
}

}  // namespace lightwell::calibrate
