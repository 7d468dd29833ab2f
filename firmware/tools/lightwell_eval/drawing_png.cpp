#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <lightwell/files.hpp>

#include "tools/lightwell_eval/drawing.hpp"

namespace lightwell::eval {
namespace {

/// Supersampling: OpenCV's stroke fonts are illegible at small sizes.
constexpr int kTimes = 4;
constexpr double kFinal = 2;  ///< Pixels of the file per pixel of the chart, for high-resolution screens.
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
/// Height of capitals: of the OpenCV font at scale 1, px, and of Helvetica relative to its em.
constexpr double kFontCapital = 21, kCapital = 0.72;

cv::Scalar color(Ink ink) { return cv::Scalar(ink.b, ink.g, ink.r); }
cv::Point point(ChartPoint at) {
  return {static_cast<int>(std::lround(at.x * kTimes)), static_cast<int>(std::lround(at.y * kTimes))};
}
int thick(double width) { return std::max(1, static_cast<int>(std::lround(width * kTimes))); }

void draw(const Stroke& s, cv::Mat& picture) {
  for (std::size_t i = 0; i + 1 < s.points.size(); ++i) {
    const ChartPoint a = s.points[i], b = s.points[i + 1];
    if (!s.dashed) {
      cv::line(picture, point(a), point(b), color(s.ink), thick(s.width), cv::LINE_AA);
      continue;
    }
    constexpr double kOn = 6, kPeriod = 11;
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    for (double t = 0; t < length; t += kPeriod) {
      const double u = t / length, v = std::min(1.0, (t + kOn) / length);
      cv::line(picture, point({a.x + u * (b.x - a.x), a.y + u * (b.y - a.y)}),
               point({a.x + v * (b.x - a.x), a.y + v * (b.y - a.y)}), color(s.ink), thick(s.width), cv::LINE_AA);
    }
  }
}

void draw(const Mark& m, cv::Mat& picture) {
  const cv::Scalar white(255, 255, 255);
  const double r = m.radius;
  if (m.square) {
    const cv::Point a = point({m.at.x - r, m.at.y - r}), b = point({m.at.x + r, m.at.y + r});
    cv::rectangle(picture, a, b, m.filled ? color(m.ink) : white, cv::FILLED, cv::LINE_AA);
    cv::rectangle(picture, a, b, color(m.ink), thick(1.8), cv::LINE_AA);
  } else {
    cv::circle(picture, point(m.at), thick(r), m.filled ? color(m.ink) : white, cv::FILLED, cv::LINE_AA);
    cv::circle(picture, point(m.at), thick(r), color(m.ink), thick(1.8), cv::LINE_AA);
  }
}

void draw(const TextLabel& w, cv::Mat& picture) {
  const int thickness = thick(w.size * (w.bold ? 0.11 : 0.07));
  double scale = w.size * kCapital / kFontCapital * kTimes;
  int below = 0;
  cv::Size size = cv::getTextSize(w.text, kFont, scale, thickness, &below);
  if (const double room = width_of(w.text, w.size, w.bold) * kTimes; size.width > room) {
    scale *= room / size.width;
    size = cv::getTextSize(w.text, kFont, scale, thickness, &below);
  }
  const double before = w.anchor == Anchor::start ? 0 : w.anchor == Anchor::middle ? 0.5 : 1;
  const cv::Point at = point(w.at);
  if (!w.upwards) {
    cv::putText(picture, w.text, {at.x - static_cast<int>(before * size.width), at.y}, kFont, scale, color(w.ink),
                thickness, cv::LINE_AA);
    return;
  }
  cv::Mat lying(size.height + 2 * below, size.width, picture.type(), cv::Scalar(255, 255, 255)), standing;
  cv::putText(lying, w.text, {0, size.height + below / 2}, kFont, scale, color(w.ink), thickness, cv::LINE_AA);
  cv::rotate(lying, standing, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect where(at.x - size.height - below / 2, at.y - static_cast<int>((1 - before) * size.width),
                       standing.cols, standing.rows);
  if ((where & cv::Rect({}, picture.size())) == where) standing.copyTo(picture(where));
}

}  // namespace

Status write_png(const Chart& chart, const std::string& path) {
  // OpenCV throws; this library returns a Status.
  try {
    cv::Mat picture(static_cast<int>(chart.height * kTimes), static_cast<int>(chart.width * kTimes), CV_8UC3,
                    cv::Scalar(255, 255, 255));
    for (const Stroke& s : chart.strokes) draw(s, picture);
    for (const Mark& m : chart.marks) draw(m, picture);
    for (const TextLabel& w : chart.texts) draw(w, picture);
    cv::Mat out;
    cv::resize(picture, out, {}, kFinal / kTimes, kFinal / kTimes, cv::INTER_AREA);
    std::vector<unsigned char> png;
    if (cv::imencode(".png", out, png))
      return write_atomically(path, {reinterpret_cast<const char*>(png.data()), png.size()}, FileMode::umask);
  } catch (const cv::Exception& e) {
    return {StatusCode::data_loss, "cannot write " + path + ": " + e.what()};
  }
  return {StatusCode::data_loss, "cannot write " + path};
}

}  // namespace lightwell::eval
