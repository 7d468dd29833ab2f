#include "firmware/estimate/oracle_cases.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include <lightwell/pixel.hpp>

#include "calibration/model/response.hpp"
#include "sim/sensor.hpp"

namespace lightwell::test {
namespace {

using reference::Codes;

unsigned levels_of(PixelFormat format) {
  return format == PixelFormat::bayer_rggb10 ? 1024 : format == PixelFormat::bayer_rggb12 ? 4096 : 256;
}

void set_response(Curve curve, PhotometricCalibration& p) {
  if (curve == Curve::as_it_comes) return;
  p.black_level = curve == Curve::linear_black ? 16.0 / 255 : 0;
  // Different values per channel detect swapped channels.
  p.white_balance = {1.3, 1, 1.6};
  switch (curve) {
    case Curve::as_it_comes:
    case Curve::linear:
    case Curve::linear_black:
      p.response.kind = ResponseCurve::Kind::linear;
      return;
    case Curve::srgb:
      p.response.kind = ResponseCurve::Kind::srgb;
      return;
    case Curve::gamma:
      p.response.kind = ResponseCurve::Kind::gamma;
      p.response.gamma = 2.2;
      return;
    case Curve::table:
      // Like film: steep near black.
      p.response.kind = ResponseCurve::Kind::table;
      p.response.inverse.clear();
      for (int i = 0; i <= 40; ++i) p.response.inverse.push_back(0.3 * i / 40 + 0.7 * std::pow(i / 40.0, 3));
      return;
  }
}

reference::Sensor sensor_of(const PhotometricCalibration& p) {
  reference::Sensor s;
  using Kind = ResponseCurve::Kind;
  const auto kind = p.response.kind;
  s.curve = kind == Kind::linear  ? reference::Sensor::Curve::linear
            : kind == Kind::srgb  ? reference::Sensor::Curve::srgb
            : kind == Kind::gamma ? reference::Sensor::Curve::gamma
                                  : reference::Sensor::Curve::table;
  s.gamma = p.response.gamma;
  s.table = p.response.inverse;
  s.black = p.black_level;
  s.saturation = p.saturation;
  s.read_noise = p.read_noise;
  s.shot_noise = p.shot_noise;
  for (std::size_t c = 0; c < 3; ++c) s.white[c] = p.white_balance[c];
  return s;
}

reference::LensPixels pixels_of(const LensTable& lens) {
  reference::LensPixels out{lens.width, lens.height, {}, {}, {}};
  for (const Vec3f& d : lens.direction) out.direction.push_back({d.x, d.y, d.z});
  out.solid_angle.assign(lens.solid_angle.begin(), lens.solid_angle.end());
  out.inverse_vignetting.assign(lens.inverse_vignetting.begin(), lens.inverse_vignetting.end());
  return out;
}

/// Writes the bytes and words of one image.
class Writer {
 public:
  Writer(PixelFormat format, int width, int height, std::size_t stride, std::vector<std::byte>& bytes)
      : format_(format), width_(width), height_(height), stride_(stride), bytes_(bytes) {}

  /// `codes` of r, g, b for each pixel.
  void write(const std::vector<std::array<unsigned, 3>>& codes) {
    const auto at = [&](int x, int y) -> const std::array<unsigned, 3>& {
      return codes[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
    };
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const auto& c = at(x, y);
        switch (format_) {
          case PixelFormat::rgb8:
            for (int k = 0; k < 3; ++k) byte(y, 3 * x + k, c[static_cast<std::size_t>(k)]);
            break;
          case PixelFormat::nv12:
            byte(y, x, luma(c));
            if (x % 2 == 0 && y % 2 == 0) {
              byte(height_ + y / 2, x, chroma({at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)}, 0));
              byte(height_ + y / 2, x + 1, chroma({at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)}, 1));
            }
            break;
          case PixelFormat::yuyv:
            byte(y, 2 * x, luma(c));
            if (x % 2 == 0) {
              byte(y, 2 * x + 1, chroma({at(x, y), at(x + 1, y)}, 0));
              byte(y, 2 * x + 3, chroma({at(x, y), at(x + 1, y)}, 1));
            }
            break;
          default: {
            const unsigned v = c[static_cast<std::size_t>(y % 2 + x % 2)];
            if (format_ == PixelFormat::bayer_rggb8) {
              byte(y, x, v);
            } else {
              byte(y, 2 * x, v & 255);
              byte(y, 2 * x + 1, v >> 8);
            }
          }
        }
      }
    }
  }

 private:
  void byte(int row, int column, unsigned v) {
    bytes_[static_cast<std::size_t>(row) * stride_ + static_cast<std::size_t>(column)] = static_cast<std::byte>(v);
  }
  // BT.601, limited range.
  static unsigned luma(const std::array<unsigned, 3>& c) {
    return static_cast<unsigned>(std::lround(16 + (65.481 * c[0] + 128.553 * c[1] + 24.966 * c[2]) / 255));
  }
  static unsigned chroma(const std::vector<std::array<unsigned, 3>>& pixels, int which) {
    double sum = 0;
    for (const auto& c : pixels)
      sum += which == 0 ? -37.797 * c[0] - 74.203 * c[1] + 112.0 * c[2] : 112.0 * c[0] - 93.786 * c[1] - 18.214 * c[2];
    return static_cast<unsigned>(std::lround(128 + sum / 255 / static_cast<double>(pixels.size())));
  }

  PixelFormat format_;
  int width_, height_;
  std::size_t stride_;
  std::vector<std::byte>& bytes_;
};

/// Codes of a pixel according to the definition of the format in proto.
Codes codes_at(const View& v, int x, int y) {
  const auto byte = [&](int row, int column) {
    return std::to_integer<unsigned>(
        v.data[static_cast<std::size_t>(row) * v.stride + static_cast<std::size_t>(column)]);
  };
  const auto ycbcr = [](unsigned l, unsigned cb, unsigned cr) {
    const auto c = rgb8_of_ycbcr601(static_cast<int>(l), static_cast<int>(cb), static_cast<int>(cr));
    return Codes{c[0], c[1], c[1], c[2], std::max({c[0], c[1], c[2]})};
  };
  switch (v.format) {
    case PixelFormat::rgb8:
      return {byte(y, 3 * x), byte(y, 3 * x + 1), byte(y, 3 * x + 1), byte(y, 3 * x + 2)};
    case PixelFormat::nv12:
    case PixelFormat::yuyv: {
      const bool quads = v.format == PixelFormat::nv12;
      const auto pixel = [&](int px, int py) {
        if (quads)
          return ycbcr(byte(py, px), byte(v.height + py / 2, px / 2 * 2), byte(v.height + py / 2, px / 2 * 2 + 1));
        return ycbcr(byte(py, 2 * px), byte(py, px / 2 * 4 + 1), byte(py, px / 2 * 4 + 3));
      };
      Codes codes = pixel(x, y);
      for (int py = quads ? y / 2 * 2 : y; py <= (quads ? y / 2 * 2 + 1 : y); ++py)
        for (int px = x / 2 * 2; px < x / 2 * 2 + 2; ++px) codes.beside = std::max(codes.beside, pixel(px, py).beside);
      return codes;
    }
    default:
      break;
  }
  const auto site = [&](int dx, int dy) {
    const int column = x / 2 * 2 + dx, row = y / 2 * 2 + dy;
    if (v.format == PixelFormat::bayer_rggb8) return byte(row, column);
    // Only the low bits are significant.
    return (byte(row, 2 * column) | byte(row, 2 * column + 1) << 8) & (levels_of(v.format) - 1);
  };
  return {site(0, 0), site(1, 0), site(0, 1), site(1, 1)};
}

float float_at(const View& v, int x, int y, int c) {
  float value;
  std::memcpy(&value, v.data.data() + static_cast<std::size_t>(y) * v.stride + static_cast<std::size_t>(12 * x + 4 * c),
              4);
  return value;
}

}  // namespace

std::string_view to_string(Curve curve) {
  switch (curve) {
    case Curve::as_it_comes:
      return "as it comes";
    case Curve::linear:
      return "linear";
    case Curve::srgb:
      return "sRGB";
    case Curve::gamma:
      return "gamma 2.2";
    case Curve::table:
      return "table";
    case Curve::linear_black:
      return "linear with black level";
  }
  return "";
}

OracleCase::OracleCase(std::string_view kind, int width, int height, PixelFormat format, Curve curve)
    : format_(format) {
  Result<RigParameters> rig = sim::make_rig(kind, width, height, format);
  if (!rig) std::abort();
  rig_ = std::move(*rig);
  set_curve(curve);
  Result<RigTable> table = make_rig_table(rig_);
  if (!table) std::abort();
  table_ = std::move(*table);
  for (const LensTable& lens : table_.lenses) lenses_.push_back(pixels_of(lens));
}

void OracleCase::set_curve(Curve curve) {
  if (format_ == PixelFormat::rgb_f32) return;
  for (LensParameters& lens : rig_.lenses) set_response(curve, lens.photometry);
}

OracleCase::Geometry& OracleCase::geometry(int edge) {
  const auto known = geometry_.find(edge);
  if (known != geometry_.end()) return known->second;
  const estimate::BlockLayout layout(table_, edge);
  Geometry made{layout, layout.make_grid(table_), {}};
  for (const reference::LensPixels& lens : lenses_) {
    const std::vector<double> part = block_harmonics(lens, edge, estimate::kTailBands.back());
    made.means.insert(made.means.end(), part.begin(), part.end());
  }
  return geometry_.emplace(edge, std::move(made)).first->second;
}

Shot OracleCase::shoot(const reference::RandomScene& scene, std::span<const double> exposures, double fill,
                       std::size_t padding) const {
  std::vector<std::vector<reference::Rgb>> linear;
  double brightest = 0;
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    const reference::LensPixels& lens = lenses_[k];
    const PhotometricCalibration& p = rig_.lenses[k].photometry;
    std::vector<reference::Rgb>& pixels = linear.emplace_back(lens.direction.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!(lens.solid_angle[i] > 0)) continue;
      pixels[i] = scene.radiance(lens.direction[i]);
      for (std::size_t c = 0; c < 3; ++c) {
        if (format_ != PixelFormat::rgb_f32) pixels[i][c] /= lens.inverse_vignetting[i] * p.white_balance[c];
        brightest = std::max(brightest, pixels[i][c]);
      }
    }
  }
  Shot out;
  for (const double exposure : exposures) {
    Frame frame;
    for (std::size_t k = 0; k < lenses_.size(); ++k) {
      const LensParameters& lens = rig_.lenses[k];
      const PhotometricCalibration& p = lens.photometry;
      const std::size_t stride = packed_stride(format_, lens.width) + padding * pixel_layout(format_).sample_bytes;
      std::vector<std::byte>& bytes =
          out.pictures.emplace_back(picture_bytes(format_, stride, lens.height), std::byte{0xEE});
      if (format_ == PixelFormat::rgb_f32) {
        frame.info.exposure_s = exposure;
        for (std::size_t i = 0; i < linear[k].size(); ++i) {
          const std::size_t at =
              i / static_cast<std::size_t>(lens.width) * stride + i % static_cast<std::size_t>(lens.width) * 12;
          for (std::size_t c = 0; c < 3; ++c) {
            const auto v = static_cast<float>(linear[k][i][c] * exposure);
            std::memcpy(bytes.data() + at + 4 * c, &v, 4);
          }
        }
      } else {
        const double full = (linearized(p.response, p.saturation) - p.black_level) / (1 - p.black_level);
        frame.info.exposure_s = exposure * fill * full / brightest;
        std::vector<std::array<unsigned, 3>> codes;
        for (const reference::Rgb& l : linear[k]) {
          std::array<unsigned, 3> code;
          for (std::size_t c = 0; c < 3; ++c) {
            const double x = p.black_level + l[c] * frame.info.exposure_s * (1 - p.black_level);
            code[c] = static_cast<unsigned>(std::lround(encoded(p.response, x) * (levels_of(format_) - 1)));
          }
          codes.push_back(code);
        }
        Writer(format_, lens.width, lens.height, stride, bytes).write(codes);
      }
      frame.add_view({static_cast<int>(k), format_, lens.width, lens.height, stride, bytes});
    }
    out.frames.push_back(std::move(frame));
  }
  return out;
}

Shot OracleCase::shoot_random_bytes(unsigned seed) const {
  std::mt19937 random(seed);
  Shot out;
  Frame frame;
  frame.info.exposure_s = 1;
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    const LensParameters& lens = rig_.lenses[k];
    const std::size_t stride = packed_stride(format_, lens.width);
    std::vector<std::byte>& bytes = out.pictures.emplace_back(picture_bytes(format_, stride, lens.height));
    for (std::byte& b : bytes) b = static_cast<std::byte>(random() >> 9);
    frame.add_view({static_cast<int>(k), format_, lens.width, lens.height, stride, bytes});
  }
  out.frames.push_back(std::move(frame));
  return out;
}

Truth OracleCase::truth(std::span<const Frame> bracket, int edge) const {
  Truth out;
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    const reference::LensPixels& lens = lenses_[k];
    std::vector<reference::PixelLight> light;
    if (format_ == PixelFormat::rgb_f32) {
      // Floats are radiance, the same in every exposure.
      const View& v = bracket[0].views()[k];
      for (int y = 0; y < lens.height; ++y) {
        for (int x = 0; x < lens.width; ++x) {
          reference::PixelLight& p = light.emplace_back();
          for (int c = 0; c < 3; ++c)
            p.radiance[static_cast<std::size_t>(c)] = float_at(v, x, y, c) / bracket[0].info.exposure_s;
        }
      }
    } else {
      std::vector<reference::CodePicture> pictures;
      for (const Frame& frame : bracket) {
        reference::CodePicture& p = pictures.emplace_back();
        p.levels = levels_of(format_);
        p.exposure = frame.info.exposure_s * frame.info.gain;
        for (int y = 0; y < lens.height; ++y)
          for (int x = 0; x < lens.width; ++x) p.codes.push_back(codes_at(frame.views()[k], x, y));
      }
      light = light_of(lens, sensor_of(rig_.lenses[k].photometry), pictures);
    }
    reference::LensLight blocks = block_light(lens, light, edge);
    out.blocks.insert(out.blocks.end(), blocks.blocks.begin(), blocks.blocks.end());
    out.clipped_sr += blocks.clipped_sr;
    out.noise += blocks.noise;
  }
  return out;
}

std::vector<reference::Rgb> OracleCase::coefficients(const Truth& truth, int edge) {
  const Geometry& g = geometry(edge);
  std::vector<double> solid_angle;
  std::vector<reference::Rgb> sums;
  for (const reference::BlockLight& b : truth.blocks) {
    solid_angle.push_back(b.solid_angle);
    sums.push_back(b.sum);
  }
  return reference::cell_coefficients(g.means, estimate::kTailBands.back(), solid_angle, sums,
                                      g.grid.fitted() ? kMaxBand : -1);
}

double deviation(const estimate::Projection& got, std::span<const reference::Rgb> truth) {
  double largest = 0, worst = 0;
  std::size_t at = 0;
  const auto compare = [&](std::size_t index) {
    for (std::size_t c = 0; c < 3; ++c) {
      largest = std::max(largest, std::abs(truth[index][c]));
      // NaN counts as the worst.
      const double off = std::abs(got.c[at][c] - truth[index][c]);
      worst = off <= worst ? worst : off;
    }
    ++at;
  };
  for (int i = 0; i < sh_count(kMaxBand); ++i) compare(static_cast<std::size_t>(i));
  for (const int l : estimate::kTailBands)
    for (int i = l * l; i < sh_count(l); ++i) compare(static_cast<std::size_t>(i));
  return worst / largest;
}

}  // namespace lightwell::test
