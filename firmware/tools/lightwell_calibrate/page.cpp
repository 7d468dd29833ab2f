#include "tools/lightwell_calibrate/page.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <lightwell/text.hpp>

#include "imaging/image_file.hpp"

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

}  // namespace lightwell::calibrate
