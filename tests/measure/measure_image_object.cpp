// Measures image-based objects (lightwell/image_object.hpp) on rendered pictures: lights between the captured ones,
// size against quality beside JPEG and x264, time. One JSON object per line. PSNR is that of sRGB values 0 to 1, over
// the pixels of the object and three channels.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/image_object.hpp>
#include <lightwell/image_object_encoder.hpp>
#include <lightwell/object_shadow.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/quantile.hpp>

#include "bench/memcpy_speed.hpp"
#include "bench/thread_time.hpp"
#include "measure/object_renders.hpp"
#include "measure/output.hpp"
#include "measure/picture_codecs.hpp"
#include "tools/command_line.hpp"

namespace lightwell {
namespace {

using measure::codes_of;
using measure::kBetween;
using measure::kLights;
using measure::picture_of;
using measure::rendered_view;
using measure::RenderedView;
using reference::PixelLight;

constexpr int kSide = 256;
constexpr int kShadowTexels = 128;
/// The soft lights of the reference data, in two of the views.
constexpr double kSoftRadiusDeg = 2;
constexpr int kSoftViews = 2;
/// The finest steps: the loss of compression is below that of 8 bits.
const ObjectEncoderOptions kFinest{0.0005F, 0.0005F, 0.0005F};

double srgb(double linear) { return linear_to_srgb(std::clamp(linear, 0.0, 1.0)); }

struct Psnr {
  double squares = 0;
  std::size_t values = 0;

  void add(const Radiance& a, const Radiance& b) {
    for (int c = 0; c < 3; ++c) {
      const double d = srgb(static_cast<double>(a[c])) - srgb(static_cast<double>(b[c]));
      squares += d * d;
    }
    values += 3;
  }
  [[nodiscard]] double db() const { return -10 * std::log10(squares / static_cast<double>(values)); }
};

/// The view as photographs of 8 bits would show it: ambient and captured lights; the truth between stays as it is.
RenderedView photographed(const RenderedView& view) {
  RenderedView out = view;
  out.ambient = picture_of(codes_of(view.ambient));
  for (std::size_t i = 0; i < kLights; ++i) out.lit[i] = picture_of(codes_of(view.lit[i]));
  return out;
}

struct EncodedView {
  ImageObject object;
  std::size_t bytes = 0;
  double encode_ms = 0;
};

EncodedView encoded(const RenderedView& view, int side, const ObjectEncoderOptions& options) {
  ObjectRig rig = measure::reference_rig(side);
  // Directions are compared in the frame of the rig.
  rig.turns_rad = {0};
  const double start = bench::thread_time_ms();
  const std::array<std::string, 1> bytes = {require(encode_view(rig, view.pictures(), options))};
  EncodedView out;
  out.encode_ms = bench::thread_time_ms() - start;
  out.object = require(ImageObject::from_bytes(require(make_image_object(rig, bytes))));
  out.bytes = out.object.view_bytes(0);
  return out;
}

ObjectLight white_light(const Vec3f& direction) { return {direction, {1, 1, 1}}; }

/// Pixels of the object that all lights around between-light j light without highlight, and without the edge of a
/// shadow.
std::vector<bool> away_from_edges(const RenderedView& view, int j) {
  std::vector<bool> out(view.pixels());
  const auto before = static_cast<std::size_t>(measure::light_before(j));
  const std::array<std::size_t, 5> lights = {before - 1, before, before + 1, before + 2,
                                             static_cast<std::size_t>(kLights + j)};
  for (std::size_t p = 0; p < out.size(); ++p)
    out[p] = view.is_object(p) &&
             std::ranges::all_of(lights, [&](std::size_t l) { return view.light[l][p] == PixelLight::lit; });
  return out;
}

struct BetweenErrors {
  Psnr all, away, captured;
  std::size_t away_pixels = 0, pixels = 0;
};

/// Adds a view's errors at lights between the captured ones, and at the captured ones.
void add_between(const RenderedView& view, const ObjectView& decoded, const ObjectRig& rig,
                 LightInterpolation interpolation, BetweenErrors& errors) {
  ObjectRelighter relighter;
  std::vector<Radiance> out(view.pixels());
  for (int j = 0; j < kBetween; ++j) {
    const std::array<ObjectLight, 1> light = {white_light(measure::between_direction(j))};
    (void)require(relighter.relight(decoded, light, interpolation, out));
    const auto& truth = view.lit[static_cast<std::size_t>(kLights + j)];
    const std::vector<bool> away = away_from_edges(view, j);
    for (std::size_t p = 0; p < out.size(); ++p) {
      if (!view.is_object(p)) continue;
      errors.all.add(out[p], truth[p]);
      ++errors.pixels;
      if (!away[p]) continue;
      errors.away.add(out[p], truth[p]);
      ++errors.away_pixels;
    }
  }
  for (std::size_t i = 0; i < kLights; i += 5) {
    const std::array<ObjectLight, 1> light = {white_light(rig.light_positions[i])};
    (void)require(relighter.relight(decoded, light, interpolation, out));
    for (std::size_t p = 0; p < out.size(); ++p)
      if (view.is_object(p)) errors.captured.add(out[p], view.lit[i][p]);
  }
}

void measure_between(const std::string& lights, const std::vector<RenderedView>& views, const std::string& data,
                     const ObjectEncoderOptions& options) {
  std::array<BetweenErrors, 2> errors;
  for (const RenderedView& view : views) {
    const EncodedView object = encoded(view, kSide, options);
    const ObjectView decoded = require(object.object.view(0));
    for (std::size_t k = 0; k < 2; ++k)
      add_between(view, decoded, object.object.rig(), k == 0 ? LightInterpolation::nearest : LightInterpolation::smooth,
                  errors[k]);
  }
  nlohmann::ordered_json line;
  line["part"] = "between";
  line["lights"] = lights;
  line["data"] = data;
  line["views"] = views.size();
  line["away_share"] = static_cast<double>(errors[0].away_pixels) / static_cast<double>(errors[0].pixels);
  for (const auto& [name, e] : {std::pair{"nearest", &errors[0]}, std::pair{"smooth", &errors[1]}}) {
    line[std::string(name) + "_db"] = e->all.db();
    line[std::string(name) + "_away_db"] = e->away.db();
  }
  line["captured_db"] = errors[1].captured.db();
  measure::print_line(line);
}

/// PSNR at the captured lights, of pictures that `picture` gives.
double captured_db(const RenderedView& view, const std::function<const std::vector<Radiance>&(std::size_t)>& picture) {
  Psnr psnr;
  for (std::size_t i = 0; i < kLights; ++i) {
    const std::vector<Radiance>& coded = picture(i);
    for (std::size_t p = 0; p < coded.size(); ++p)
      if (view.is_object(p)) psnr.add(coded[p], view.lit[i][p]);
  }
  return psnr.db();
}

/// Squared errors and bytes over views.
struct RatePoint {
  double squares = 0;
  std::size_t bytes = 0, views = 0;
  double decode_ms = 0, relight_ms = 0, encode_ms = 0;

  void add(double db, std::size_t more) {
    squares += std::pow(10, -db / 10);
    bytes += more;
    ++views;
  }
  void print(const std::string& codec, const std::string& setting) const {
    if (views == 0) return;
    const auto n = static_cast<double>(views);
    nlohmann::ordered_json line;
    line["part"] = "rate";
    line["codec"] = codec;
    line["setting"] = setting;
    line["views"] = views;
    line["bytes_per_view"] = static_cast<double>(bytes) / n;
    line["db"] = -10 * std::log10(squares / n);
    line["raw_ratio"] = n * 3 * kSide * kSide * kLights / static_cast<double>(bytes);
    if (decode_ms > 0) {
      line["decode_ms"] = decode_ms / n;
      line["relight_ms"] = relight_ms / n;
      line["encode_ms"] = encode_ms / n;
    }
    measure::print_line(line);
  }
};

/// Three lights in colours, between captured positions.
std::vector<ObjectLight> three_lights() {
  return {{measure::between_direction(2), {1, 0.9F, 0.7F}},
          {measure::between_direction(6), {0.2F, 0.3F, 0.5F}},
          {measure::between_direction(10), {0.5F, 0.2F, 0.1F}}};
}

double median_relight_ms(const ObjectView& view, std::span<const ObjectLight> lights) {
  ObjectRelighter relighter;
  std::vector<Radiance> out(view.coverage().size());
  std::vector<double> times;
  for (int k = 0; k < 25; ++k) {
    const double start = bench::thread_time_ms();
    (void)require(relighter.relight(view, lights, LightInterpolation::smooth, out));
    times.push_back(bench::thread_time_ms() - start);
  }
  return median(times);
}

/// Shadows of the three lights, with a radius of 2 degrees, on the ground.
double median_shadow_ms(const ImageObject& object) {
  const ObjectShadowCaster caster = require(ObjectShadowCaster::make(object));
  ObjectShadowPlane ground{
      {Quat::about({1, 0, 0}, -reference::pi / 2), {0, -0.74, 0}}, 4, 4, kShadowTexels, kShadowTexels};
  std::vector<LightRatio> ratios(static_cast<std::size_t>(kShadowTexels) * kShadowTexels);
  std::vector<ObjectLight> lights = three_lights();
  for (ObjectLight& light : lights) light.angular_radius_rad = static_cast<float>(2 * reference::pi / 180);
  std::vector<double> times;
  for (int k = 0; k < 25; ++k) {
    const double start = bench::thread_time_ms();
    (void)require(caster.cast(lights, ground, ratios));
    times.push_back(bench::thread_time_ms() - start);
  }
  return median(times);
}

double median_decode_ms(const ImageObject& object) {
  std::vector<double> times;
  for (int k = 0; k < 9; ++k) {
    const double start = bench::thread_time_ms();
    (void)require(object.view(0));
    times.push_back(bench::thread_time_ms() - start);
  }
  return median(times);
}

void add_object(const RenderedView& view, const ObjectEncoderOptions& options, RatePoint& point) {
  const EncodedView object = encoded(view, kSide, options);
  const ObjectView decoded = require(object.object.view(0));
  ObjectRelighter relighter;
  std::vector<Radiance> out(view.pixels());
  const double db = captured_db(view, [&](std::size_t i) -> const std::vector<Radiance>& {
    const std::array<ObjectLight, 1> light = {white_light(object.object.rig().light_positions[i])};
    (void)require(relighter.relight(decoded, light, LightInterpolation::smooth, out));
    return out;
  });
  point.add(db, object.bytes);
  point.encode_ms += object.encode_ms;
  point.decode_ms += median_decode_ms(object.object);
  point.relight_ms += median_relight_ms(decoded, three_lights());
}

/// The uncompressed factors of equations 3 to 7: what one base colour, without and with highlights, can show.
void measure_model(const std::vector<RenderedView>& views) {
  for (const auto& [name, kind] : {std::pair{"one base colour (seed)", BaseColor::ambient},
                                   std::pair{"base colour and highlights", BaseColor::highlights}}) {
    RatePoint point;
    std::size_t reduced = 0;
    for (const RenderedView& view : views) {
      const ViewFactors f = require(factor_view(measure::reference_rig(kSide), view.pictures(), kind));
      reduced += f.reduced;
      std::vector<Radiance> out(view.pixels());
      point.add(captured_db(view,
                            [&](std::size_t i) -> const std::vector<Radiance>& {
                              for (std::size_t p = 0; p < out.size(); ++p) {
                                const float white = f.highlight.empty() ? 0 : f.highlight[i][p];
                                out[p] = f.base[p] * (f.luminance[i][p] - white) +
                                         f.second[p] * (white * f.base[p].luminance());
                              }
                              return out;
                            }),
                0);
    }
    nlohmann::ordered_json line;
    line["part"] = "model";
    line["model"] = name;
    line["db"] = -10 * std::log10(point.squares / static_cast<double>(point.views));
    line["reduced"] = reduced;
    measure::print_line(line);
  }
}

void measure_rate(const std::vector<RenderedView>& views, const std::string& folder) {
  const ObjectEncoderOptions preset;
  for (const float factor : {0.5F, 0.7F, 0.85F, 1.0F, 1.4F, 2.0F, 3.0F}) {
    RatePoint point;
    for (const RenderedView& view : views)
      add_object(view, {factor * preset.luminance_step, factor * preset.highlight_step, factor * preset.base_step},
                 point);
    char setting[32];
    std::snprintf(setting, sizeof setting, "steps x %g", static_cast<double>(factor));
    point.print("lightwell", factor == 1 ? "default" : setting);
  }
  for (const bool subsampled : {false, true})
    for (const int quality : {40, 60, 75, 82, 86, 88, 90, 92, 94, 96}) {
      RatePoint point;
      for (const RenderedView& view : views) {
        std::size_t bytes = 0;
        std::vector<Radiance> picture;
        const double db = captured_db(view, [&](std::size_t i) -> const std::vector<Radiance>& {
          const auto coded = measure::code_jpeg(codes_of(view.lit[i]), kSide, kSide, {quality, subsampled});
          if (!coded) refuse("libjpeg failed");
          bytes += coded->bytes;
          picture = picture_of(coded->rgb);
          return picture;
        });
        point.add(db, bytes);
      }
      point.print(subsampled ? "jpeg 4:2:0" : "jpeg 4:4:4", "quality " + std::to_string(quality));
    }
  for (const int crf : {8, 12, 15, 18, 22, 26}) {
    RatePoint point;
    for (const RenderedView& view : views) {
      std::vector<std::uint8_t> frames;
      for (std::size_t i = 0; i < kLights; ++i) {
        const auto codes = codes_of(view.lit[i]);
        frames.insert(frames.end(), codes.begin(), codes.end());
      }
      const auto coded = measure::code_x264(frames, kSide, kSide, crf, folder);
      if (!coded) return;
      std::vector<Radiance> picture;
      const std::size_t size = frames.size() / kLights;
      point.add(captured_db(view,
                            [&](std::size_t i) -> const std::vector<Radiance>& {
                              picture = picture_of(std::span(coded->rgb).subspan(i * size, size));
                              return picture;
                            }),
                coded->bytes);
    }
    point.print("x264 4:4:4", "crf " + std::to_string(crf));
  }
}

/// A view of 512 x 512 pixels.
void measure_speed(const reference::ObjectRenderer& renderer, const std::string& folder) {
  constexpr int kLarge = 512;
  const RenderedView view = photographed(require(rendered_view(renderer, {0, kLarge, 2, 0}, folder)));
  const EncodedView object = encoded(view, kLarge, {});
  const ObjectView decoded = require(object.object.view(0));
  const bench::MemcpySpeed copy = bench::memcpy_speed(decoded.bytes_read());
  nlohmann::ordered_json line;
  line["part"] = "speed";
  line["side"] = kLarge;
  line["bytes_per_view"] = object.bytes;
  line["bytes_read"] = decoded.bytes_read();
  line["covered"] =
      static_cast<double>(std::ranges::count_if(view.coverage, [](auto c) { return c > 0; })) / (kLarge * kLarge);
  line["relight_ms"] = median_relight_ms(decoded, three_lights());
  line["shadow_ms"] = median_shadow_ms(object.object);
  std::vector<ObjectLight> many;
  for (int i = 0; i < 32; ++i) many.push_back(white_light(measure::between_direction(i % kBetween)));
  line["relight_32_lights_ms"] = median_relight_ms(decoded, many);
  line["memcpy_ratio"] = line["relight_ms"].get<double>() / (1e3 * copy.seconds_per_copy);
  line["memcpy_gb_s"] = copy.gigabytes_per_s;
  line["decode_ms"] = median_decode_ms(object.object);
  line["encode_ms"] = object.encode_ms;
  measure::print_line(line);
}

std::vector<RenderedView> render_views(const reference::ObjectRenderer& renderer, int count, int samples,
                                       double radius_deg, const std::string& folder) {
  std::vector<RenderedView> views(static_cast<std::size_t>(count));
  std::vector<Status> states(views.size());
  const auto render_every_second = [&](std::size_t first) {
    for (std::size_t v = first; v < views.size(); v += 2)
      states[v] =
          rendered_view(renderer, {static_cast<int>(v), kSide, samples, radius_deg}, folder).assign_to(views[v]);
  };
  std::thread other(render_every_second, 1);
  render_every_second(0);
  other.join();
  for (const Status& state : states) require(state);
  return views;
}

}  // namespace
}  // namespace lightwell

int main(int argc, char** argv) {
  using namespace lightwell;
  std::string folder;
  int views = measure::kViews;
  std::vector<std::string> parts;
  CLI::App app{"Image-based objects: lights between the captured ones, size against quality, time.",
               "measure_image_object"};
  app.add_option("--renders", folder, "Folder in which rendered views are kept; without it each run renders them");
  app.add_option("--views", views, "Views with point lights that are measured [8]")
      ->check(CLI::Range(1, measure::kViews));
  app.add_option("--part", parts, "between, model, rate or speed; may be repeated [all]")
      ->check(CLI::IsMember({"between", "model", "rate", "speed"}));
  app.footer("Rendering takes two minutes on two cores. Exit status: 0 measured, 1 failed, 2 wrong usage.");
  return run_command(app, {argv + 1, argv + argc}, [&] {
    const auto wanted = [&](const char* part) {
      return parts.empty() || std::ranges::find(parts, part) != parts.end();
    };
    const reference::ObjectRenderer renderer;
    if (wanted("between") || wanted("model") || wanted("rate")) {
      const std::vector<RenderedView> hard = render_views(renderer, views, 4, 0, folder);
      std::vector<RenderedView> pictures;
      for (const RenderedView& view : hard) pictures.push_back(photographed(view));
      if (wanted("between")) {
        const std::vector<RenderedView> soft =
            render_views(renderer, std::min(views, kSoftViews), 6, kSoftRadiusDeg, folder);
        std::vector<RenderedView> soft_pictures;
        for (const RenderedView& view : soft) soft_pictures.push_back(photographed(view));
        // The finest steps take long; two views are as many as there are with soft lights.
        const std::vector<RenderedView> some(hard.begin(), hard.begin() + static_cast<std::ptrdiff_t>(soft.size()));
        measure_between("point", some, "linear pictures, finest steps", kFinest);
        measure_between("2 degrees", soft, "linear pictures, finest steps", kFinest);
        measure_between("point", pictures, "8 bits, default steps", {});
        measure_between("2 degrees", soft_pictures, "8 bits, default steps", {});
      }
      if (wanted("model")) measure_model(pictures);
      const std::string scratch = folder.empty() ? std::filesystem::temp_directory_path().string() : folder;
      if (wanted("rate")) measure_rate(pictures, scratch);
    }
    if (wanted("speed")) measure_speed(renderer, folder);
    return kDone;
  });
}
