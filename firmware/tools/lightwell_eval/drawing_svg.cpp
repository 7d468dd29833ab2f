#include <array>
#include <cctype>
#include <cstdio>
#include <sstream>
#include <string_view>

#include <lightwell/files.hpp>

#include "tools/lightwell_eval/drawing.hpp"

namespace lightwell::eval {
namespace {

std::string number(double v) {
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%.1f", v);
  return out.data();
}

std::string color(Ink ink) {
  return "rgb(" + std::to_string(ink.r) + "," + std::to_string(ink.g) + "," + std::to_string(ink.b) + ")";
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

}  // namespace

double width_of(const std::string& text, double size, bool bold) {
  double em = 0;
  for (const char c : text) {
    if (std::string_view("il.,:;'|!").find(c) != std::string_view::npos)
      em += 0.26;
    else if (std::string_view("fjt/() -[]r").find(c) != std::string_view::npos)
      em += 0.32;
    else if (c == 'm' || c == '%' || c == 'M' || c == 'W')
      em += 0.87;
    else if (c == '@')
      em += 1.0;
    else if (std::isupper(static_cast<unsigned char>(c)) != 0 || c == 'w')
      em += 0.70;
    else
      em += 0.556;
  }
  return em * size * (bold ? 1.07 : 1);
}

Status write_svg(const Chart& chart, const std::string& path) {
  std::ostringstream out;
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << number(chart.width) << "\" height=\""
      << number(chart.height) << "\" viewBox=\"0 0 " << number(chart.width) << " " << number(chart.height)
      << "\" font-family=\"Helvetica, Arial, 'Liberation Sans', sans-serif\">\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (const Stroke& s : chart.strokes) {
    out << "<polyline fill=\"none\" stroke=\"" << color(s.ink) << "\" stroke-width=\"" << number(s.width) << "\""
        << (s.dashed ? " stroke-dasharray=\"6 5\"" : "") << " points=\"";
    for (const ChartPoint& p : s.points) out << number(p.x) << "," << number(p.y) << " ";
    out << "\"/>\n";
  }
  for (const Mark& m : chart.marks) {
    const std::string paint = " fill=\"" + (m.filled ? color(m.ink) : "white") + "\" stroke=\"" + color(m.ink) +
                              "\" stroke-width=\"1.8\"/>\n";
    if (m.square)
      out << "<rect x=\"" << number(m.at.x - m.radius) << "\" y=\"" << number(m.at.y - m.radius) << "\" width=\""
          << number(2 * m.radius) << "\" height=\"" << number(2 * m.radius) << "\"" << paint;
    else
      out << "<circle cx=\"" << number(m.at.x) << "\" cy=\"" << number(m.at.y) << "\" r=\"" << number(m.radius) << "\""
          << paint;
  }
  for (const TextLabel& w : chart.texts) {
    out << "<text x=\"" << number(w.at.x) << "\" y=\"" << number(w.at.y) << "\" font-size=\"" << number(w.size)
        << "\" fill=\"" << color(w.ink) << "\" text-anchor=\""
        << (w.anchor == Anchor::start    ? "start"
            : w.anchor == Anchor::middle ? "middle"
                                         : "end")
        << "\"" << (w.bold ? " font-weight=\"bold\"" : "");
    if (w.upwards) out << " transform=\"rotate(-90 " << number(w.at.x) << " " << number(w.at.y) << ")\"";
    out << ">" << escaped(w.text) << "</text>\n";
  }
  out << "</svg>\n";
  return write_atomically(path, out.str(), FileMode::umask);
}

}  // namespace lightwell::eval
