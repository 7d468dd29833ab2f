#include "tools/lightwell_calibrate/page.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "camera/image_file.hpp"

namespace lightwell::calibrate {

namespace {

constexpr double kPointsPerMm = 72 / 25.4;

/// Plain decimals: neither PDF nor old SVG readers know exponents. A hundred thousandth of a point is 4 nm.
std::string number(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.5f", value);
  std::string out = text;
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
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

}  // namespace

std::string page_to_pdf(const Page& page) {
  // y grows upwards in PDF (ISO 32000-1, 8.3.2.3).
  const auto y = [&](double mm) { return number((page.height - mm) * kPointsPerMm); };
  const auto x = [](double mm) { return number(mm * kPointsPerMm); };
  std::string content = "0 g\n";
  for (const auto& shape : page.shapes) {
    for (const Rectangle& r : shape)
      content += x(r.x) + " " + y(r.y + r.height) + " " + x(r.width) + " " + x(r.height) + " re\n";
    content += "f\n";
  }
  for (const PageText& t : page.texts)
    content += "BT /F1 " + x(t.size) + " Tf " + x(t.x) + " " + y(t.y) + " Td (" + escaped_pdf(t.text) + ") Tj ET\n";
  const std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 " + x(page.width) + " " + x(page.height) +
          "] /Contents 4 0 R /Resources << /Font << /F1 5 0 R >> >> >>",
      "<< /Length " + std::to_string(content.size()) + " >>\nstream\n" + content + "endstream",
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>"};
  std::string out = "%PDF-1.6\n%\xE2\xE3\xCF\xD3\n";
  std::string table = "0000000000 65535 f \n";
  for (std::size_t i = 0; i < objects.size(); ++i) {
    char entry[32];
    std::snprintf(entry, sizeof entry, "%010zu 00000 n \n", out.size());
    table += entry;
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
  for (const auto& shape : page.shapes) {
    out += "<path fill=\"#000\" d=\"";
    for (const Rectangle& r : shape)
      out += "M" + number(r.x) + " " + number(r.y) + "h" + number(r.width) + "v" + number(r.height) + "h" +
             number(-r.width) + "z";
    out += "\"/>\n";
  }
  for (const PageText& t : page.texts)
    out += "<text x=\"" + number(t.x) + "\" y=\"" + number(t.y) + "\" font-size=\"" + number(t.size) +
           "\" font-family=\"Helvetica, Arial, sans-serif\">" + escaped_xml(t.text) + "</text>\n";
  return out + "</svg>\n";
}

Status write_page_png(const Page& page, double dots_per_inch, const std::string& path) {
  constexpr double kMostPixels = 64e6;
  const double scale = dots_per_inch / 25.4;
  const double wide = std::round(page.width * scale), high = std::round(page.height * scale);
  if (!(wide >= 1 && high >= 1 && wide * high <= kMostPixels))
    return {StatusCode::resource_exhausted, path + ": " + number(dots_per_inch) + " dots an inch make " + number(wide) +
                                                "x" + number(high) + " pixels; at most 64 megapixels are written"};
  const int width = static_cast<int>(wide), height = static_cast<int>(high);
  cv::Mat black(height, width, CV_32F, cv::Scalar(0));
  const auto covered = [](double from, double to, int i) {
    return std::max(0.0, std::min(to, i + 1.0) - std::max(from, static_cast<double>(i)));
  };
  for (const auto& shape : page.shapes)
    for (const Rectangle& r : shape) {
      const double x0 = r.x * scale, x1 = (r.x + r.width) * scale, y0 = r.y * scale, y1 = (r.y + r.height) * scale;
      for (int y = std::max(0, static_cast<int>(y0)); y < std::min(height, static_cast<int>(std::ceil(y1))); ++y)
        for (int x = std::max(0, static_cast<int>(x0)); x < std::min(width, static_cast<int>(std::ceil(x1))); ++x)
          black.at<float>(y, x) += static_cast<float>(covered(x0, x1, x) * covered(y0, y1, y));
    }
  cv::Mat grey;
  black.convertTo(grey, CV_8U, -255, 255);
  for (const PageText& t : page.texts) {
    // OpenCV's letters: capitals of 21 px at scale 1; Helvetica's are 0.72 of its em.
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
