#include "calibration/solve/photometry/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

namespace lightwell::photometry {
namespace {

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, what}; }

std::string size_text(const Picture& p) { return std::to_string(p.width) + "x" + std::to_string(p.height); }

constexpr std::size_t kMaxCandidates = 40000;
/// Number of series, and of brightness classes, each of which contributes the same number of series.
constexpr std::size_t kSeries = 600, kShades = 20;
/// Side of the block of sites that a series averages: reduces noise and the effect of camera shake.
constexpr int kBlock = 3;
constexpr int kTiles = 4;
/// Decrease in a longer exposure, as a fraction of full scale, up to which it counts as noise.
constexpr double kMaxDecrease = 0.03;
/// Margin above saturation for single pixels of a block: noise may carry some above saturation while the mean is below,
/// and rejecting such blocks would bias the selection towards dark ones.
constexpr double kSaturationMargin = 0.015;

struct Candidate {
  PixelSeries series;
  double shade = 0;          ///< Mean over the exposures; increases with the light.
  double nonuniformity = 0;  ///< Largest difference inside the block, summed over the exposures.
  int tile = 0;
};

Candidate candidate_at(std::span<const Picture> pictures, int x, int y, int channel, double saturation) {
  Candidate out;
  out.series.channel = channel;
  for (const Picture& p : pictures) {
    double sum = 0, low = 1e9, high = -1e9;
    for (int j = 0; j < kBlock; ++j)
      for (int i = 0; i < kBlock; ++i) {
        const double v = static_cast<double>(p.at(x + i, y + j, channel));
        sum += v;
        low = std::min(low, v);
        high = std::max(high, v);
      }
    const bool saturated = high >= std::min(1.0, saturation + kSaturationMargin);
    const double mean = saturated ? std::max(high, 1.0) : sum / (kBlock * kBlock);
    out.series.values.push_back(mean);
    out.shade += std::clamp(mean, 0.0, 1.0) / static_cast<double>(pictures.size());
    out.nonuniformity += saturated ? 0 : high - low;
  }
  out.tile = x * kTiles / pictures.front().width + kTiles * (y * kTiles / pictures.front().height);
  return out;
}

bool rises(const PixelSeries& series, std::span<const std::size_t> order) {
  double highest = -1;
  for (const std::size_t j : order) {
    if (series.values[j] < highest - kMaxDecrease) return false;
    highest = std::max(highest, series.values[j]);
  }
  return true;
}

}  // namespace

Result<Picture> picture_of(const View& view, const std::string& name, int float_levels) {
  const PixelLayout& layout = pixel_layout(view.format);
  if (layout.sampling == ColorSampling::ycbcr)
    return invalid(name + ": " + std::string(to_string(view.format)) +
                   " mixes the values of neighbours; record rgb8 or Bayer for a calibration");
  if (const Status s = check_view(view); !s.ok()) return invalid(name + ": " + s.message());
  Picture out;
  out.pitch = layout.unit_width;
  out.width = view.width / out.pitch;
  out.height = view.height / out.pitch;
  out.levels = layout.is_float() ? float_levels : layout.levels();
  out.rgb.reserve(3 * out.sites());
  const double top = out.levels - 1;
  for (int y = 0; y < out.height; ++y) {
    if (is_bayer(view.format)) {
      for (int x = 0; x < out.width; ++x) {
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x, 2 * y) / top));
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x + 1, 2 * y) / top));
        out.rgb.push_back(static_cast<float>(code_at(view, 2 * x + 1, 2 * y + 1) / top));
      }
      continue;
    }
    const std::byte* row = view.data.data() + static_cast<std::size_t>(y) * view.stride;
    for (std::size_t k = 0; k < 3 * static_cast<std::size_t>(out.width); ++k) {
      if (!layout.is_float()) {
        out.rgb.push_back(static_cast<float>(std::to_integer<int>(row[k]) / top));
        continue;
      }
      float v;
      std::memcpy(&v, row + k * sizeof v, sizeof v);
      if (!std::isfinite(v)) return invalid(name + ": a value is not finite; picture values run from 0 to 1");
      out.rgb.push_back(v);
    }
  }
  return out;
}

double rounding_deviation(int levels) { return levels > 1 ? 1 / (std::sqrt(12.0) * (levels - 1)) : 0; }

Status check_alike(std::span<const Picture> pictures, std::size_t least, const std::string& what) {
  if (pictures.size() < least)
    return invalid(what + ": " + std::to_string(pictures.size()) + " pictures, at least " + std::to_string(least) +
                   " are needed; take more");
  for (const Picture& p : pictures) {
    const Picture& first = pictures.front();
    if (p.width != first.width || p.height != first.height || p.pitch != first.pitch || p.levels != first.levels)
      return invalid(what + ": pictures of " + size_text(first) + " with " + std::to_string(first.levels) +
                     " levels and of " + size_text(p) + " with " + std::to_string(p.levels) +
                     "; take all with one camera mode");
    if (p.rgb.size() != 3 * p.sites() || p.sites() == 0) return invalid(what + ": an empty picture");
  }
  return {};
}

Result<ResponseSamples> choose_samples(std::span<const Picture> pictures, std::span<const double> exposures,
                                       double dark_value, double saturation) {
  if (const Status s = check_alike(pictures, 3, "response"); !s.ok()) return s;
  if (exposures.size() != pictures.size())
    return invalid("response: " + std::to_string(exposures.size()) + " exposures for " +
                   std::to_string(pictures.size()) + " pictures");
  const Picture& first = pictures.front();
  std::vector<std::size_t> order(exposures.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return exposures[a] < exposures[b]; });

  int step = kBlock;
  while (static_cast<std::size_t>(first.width / step) * static_cast<std::size_t>(first.height / step) > kMaxCandidates)
    ++step;
  std::vector<Candidate> candidates;
  std::size_t moved = 0;
  for (int y = 0, row = 0; y + kBlock <= first.height; y += step, ++row)
    for (int x = 0, column = 0; x + kBlock <= first.width; x += step, ++column) {
      Candidate c = candidate_at(pictures, x, y, (row + column) % 3, saturation);
      if (rises(c.series, order))
        candidates.push_back(std::move(c));
      else
        ++moved;
    }
  if (candidates.size() < 20 || moved > candidates.size())
    return invalid("response: " + std::to_string(moved) + " of " + std::to_string(moved + candidates.size()) +
                   " places get darker in a longer exposure, " + std::to_string(candidates.size()) +
                   " are left; keep camera and scene still, and check the exposures in the list");

  // Blocks that are dark or saturated in all exposures are not usable.
  const auto [low, high] = std::minmax_element(candidates.begin(), candidates.end(),
                                               [](const auto& a, const auto& b) { return a.shade < b.shade; });
  const double darkest = std::max(low->shade, dark_value + 1e-3), brightest = std::min(high->shade, saturation);
  std::vector<std::vector<const Candidate*>> shades(kShades);
  for (const Candidate& c : candidates) {
    if (c.shade < darkest || c.shade > brightest) continue;
    const double at = brightest > darkest ? (c.shade - darkest) / (brightest - darkest) * kShades : 0;
    shades[std::min(static_cast<std::size_t>(at), shades.size() - 1)].push_back(&c);
  }

  ResponseSamples out;
  out.exposures.assign(exposures.begin(), exposures.end());
  out.levels = first.levels;
  out.dark_value = dark_value;
  out.saturation = saturation;
  const std::size_t wanted = kSeries / kShades;
  for (auto& shade : shades) {
    std::stable_sort(shade.begin(), shade.end(),
                     [](const Candidate* a, const Candidate* b) { return a->nonuniformity < b->nonuniformity; });
    std::vector<std::size_t> in_tile(kTiles * kTiles);
    std::size_t taken = 0;
    // At most a quarter of the series from one of 16 regions of the picture.
    for (const Candidate* c : shade) {
      auto& count = in_tile[static_cast<std::size_t>(c->tile)];
      if (taken == wanted || count > wanted / 4) continue;
      out.pixels.push_back(c->series);
      ++count;
      ++taken;
    }
  }
  return out;
}

}  // namespace lightwell::photometry
