#include "host_sdk/answers/plane_answers.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_codec.hpp>
#include <lightwell/plane_light.hpp>
#include <lightwell/plane_reflection.hpp>
#include <lightwell/recording.hpp>
#include <lightwell/shadows.hpp>
#include <lightwell/text.hpp>

#include "host_sdk/answers/mutation.hpp"
#include "host_sdk/scenes.hpp"

namespace lightwell::test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kKeyInterval_ms = 10'000;

std::string floats(std::initializer_list<double> values) {
  std::string out;
  for (const double v : values) out += formatted(" %.9g", v);
  return out;
}
std::string doubles(std::initializer_list<double> values) {
  std::string out;
  for (const double v : values) out += formatted(" %.17g", v);
  return out;
}
std::string doubles(const Vec3d& v) { return doubles({v.x, v.y, v.z}); }
std::string rgb_of(const Radiance& v) { return floats({v.r, v.g, v.b}); }

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A plane with unseen, measured and clipped entries, turned and shifted texture, and gaps in the coverage.
CapturedPlane random_plane(std::uint32_t capture, int edge, int lumisphere_levels, int coverage_levels,
                           std::mt19937& random) {
  std::uniform_real_distribution<float> share(0, 1);
  const auto state = [&] {
    const float v = share(random);
    return v < 0.1F ? SampleState::unseen : v < 0.2F ? SampleState::clipped : SampleState::measured;
  };
  const auto radiance = [&] { return Radiance{share(random), 2 * share(random), 30 * share(random)}; };
  CapturedPlane out;
  out.info = {.capture = capture,
              .mid_exposure = {5'000 * kMs},
              .units = Units::absolute,
              .size_m = 0.2,
              .T_probe_plane = Pose{Quat::about({0, 1, 0}, 0.3), {0.1, -0.05, -0.4}},
              .texture_to_plane = {0.01, -0.02, 0.4, 1.25},
              .gloss_alpha = 0.125F,
              .f0 = 0.04F};
  out.texture.edge = edge;
  for (std::size_t k = 0; k < out.texture.count(); ++k) {
    out.texture.radiance.push_back(radiance());
    out.texture.state.push_back(state());
  }
  out.lumisphere.grid = HemisphereGrid(lumisphere_levels);
  out.coverage.grid = HemisphereGrid(coverage_levels);
  for (std::size_t n = 0; n < out.lumisphere.grid.size(); ++n) {
    out.lumisphere.radiance.push_back(radiance());
    out.lumisphere.state.push_back(state());
  }
  for (std::size_t n = 0; n < out.coverage.grid.size(); ++n) {
    // One side was seen densely, the other hardly.
    const double limit = out.coverage.grid.direction(n).x > 0.1 ? 0.9 : 0.02;
    out.coverage.seen.push_back(share(random) < limit ? 1 : 0);
  }
  return out;
}

class PlaneAnswers {
 public:
  explicit PlaneAnswers(const std::filesystem::path& folder)
      : out_(folder / "planes.txt"), recording_(open_recording(folder / "planes.lwrec")) {
    const std::string descriptor = encoded(numbered(1, 1'000 * kMs));
    require(recording_.append(0, as_bytes(descriptor)));
  }

  void take(const std::vector<std::byte>& message, std::int64_t at_ms) {
    const Status status = reader_.take(message, {at_ms * kMs});
    out_ << "take " << to_string(status.code()) << ' ' << at_ms << ' ' << hex_of(text_of(message)) << '\n';
    if (status.ok()) require(recording_.append(at_ms * kMs, message, RecordedMessage::plane));
  }

  void ask(std::int64_t at_ms) {
    const PlaneAppearance plane = reader_.snapshot({at_ms * kMs});
    out_ << "snapshot " << at_ms << '\n';
    const PlaneInfo& i = plane.info();
    const auto& [x, y, rotation, scale] = i.texture_to_plane;
    out_ << "info " << static_cast<int>(plane.validity()) << ' ' << plane.revision() << ' ' << plane.missing_tiles()
         << ' ' << i.capture << ' ' << plane.texture_edge() << doubles({i.size_m, x, y, rotation, scale})
         << floats({i.gloss_alpha.value_or(-1.0F), i.f0.value_or(-1.0F)}) << ' ' << static_cast<int>(i.units) << '\n';
    if (i.T_probe_plane) {
      const auto& [q, t] = *i.T_probe_plane;
      out_ << "pose" << doubles(t) << doubles({q.x, q.y, q.z, q.w}) << '\n';
    }
    ask_radiance(plane);
    ask_texels(plane);
    ask_guidance(plane);
    ask_pixels(plane);
  }

  void finish() {
    require(recording_.flush());
    if (!out_.flush()) throw std::runtime_error("cannot write planes.txt");
  }

 private:
  static void require(const Status& status) {
    if (!status.ok()) throw std::runtime_error(status.message());
  }
  static RecordWriter open_recording(const std::filesystem::path& path) {
    std::filesystem::remove(path);
    Result<RecordWriter> writer =
        RecordWriter::open(path.string(), {RecordingKind::descriptors_and_planes, "attic", "0.1.0", {}});
    require(writer.status());
    return std::move(*writer);
  }

  static std::string answer_of(const PlaneAnswer& answer) {
    return " " + std::to_string(static_cast<int>(answer.validity)) + " " + std::to_string(answer.flags.bits()) +
           rgb_of(answer.value);
  }

  void ask_radiance(const PlaneAppearance& plane) {
    std::mt19937 random(3);
    // Beyond the square, too, and behind the plane.
    std::uniform_real_distribution<double> place(-0.13, 0.13), height(-0.02, 0.6);
    for (int k = 0; k < 60; ++k) {
      const PlanePoint p{place(random), place(random)};
      const Vec3d eye{4 * place(random), 4 * place(random), height(random)};
      out_ << "radiance " << k % 3 << doubles({p.x, p.y}) << doubles(eye)
           << answer_of(plane.radiance(p, eye, static_cast<PlaneLayers>(k % 3))) << '\n';
      const Vec3d viewer{eye.x - p.x, eye.y - p.y, eye.z};
      out_ << "specular" << doubles(viewer) << answer_of(plane.specular(viewer)) << '\n';
    }
    for (const Vec3d& d : {Vec3d{0, 0, 1},
                           {1, 0, 1},
                           {0, 1, 1},
                           {-1, 0, 1},
                           {0, -1, 1},
                           {1e300, 1, 1e300},
                           {1, 0, 1e-9},
                           {0, 0, 0},
                           {0, 0, -1},
                           {-0.0, 0.5, 0.5}})
      out_ << "specular" << doubles(d) << answer_of(plane.specular(d)) << '\n';
  }

  void ask_texels(const PlaneAppearance& plane) {
    const int edge = plane.texture_edge();
    for (int k = 0; k < edge * edge; k += 13) {
      const double size = plane.info().size_m;
      const PlanePoint texture{((k % edge + 0.5) / edge - 0.5) * size, (0.5 - (k / edge + 0.5) / edge) * size};
      const PlaneAnswer answer = plane.diffuse(plane.info().texture_to_plane.plane_point(texture));
      if (answer.validity == Validity::none) continue;
      out_ << "texel " << k << ' ' << static_cast<int>(answer.flags.bits()) << rgb_of(answer.value) << '\n';
    }
  }

  void ask_guidance(const PlaneAppearance& plane) {
    if (plane.revision() == 0) return;
    const PlaneGuidance g = plane.guidance();
    out_ << "guidance " << static_cast<int>(g.progress) << doubles({g.seen, g.gap_rad})
         << doubles(g.next.value_or(Vec3d{})) << doubles({guidance_disc_radius()}) << '\n';
    out_ << "probe" << doubles(probe_direction(plane.info()).value_or(Vec3d{})) << '\n';
    const PlaneCoverage& coverage = plane.coverage();
    for (std::size_t n = 0; n < coverage.grid.size(); n += 11) {
      const DiscPoint point = stereographic(coverage.grid.direction(n));
      out_ << "coverage " << n << doubles({point.x, point.y}) << ' ' << static_cast<int>(coverage.seen[n]) << '\n';
    }
  }

  void ask_pixels(const PlaneAppearance& plane) {
    const Quat q = Quat::about({0.8, 0.6, 0}, 0.5);
    for (const PlaneLayers layers : {PlaneLayers::all, PlaneLayers::diffuse, PlaneLayers::specular}) {
      const PlaneCamera camera{24, 18, 30, 28, 11.3, 8.9, {q, {0.11, -0.15, 0.33}}};
      std::vector<float> rgb(std::size_t{3} * 24 * 18, -1);
      std::vector<std::uint8_t> flags(std::size_t{24} * 18);
      const PlaneRendering about = plane.render(camera, layers, rgb, flags);
      out_ << "camera 24 18" << doubles({camera.fx, camera.fy, camera.cx, camera.cy})
           << doubles(camera.T_plane_camera.translation) << doubles({q.x, q.y, q.z, q.w}) << ' '
           << static_cast<int>(layers) << ' ' << static_cast<int>(about.validity) << ' '
           << static_cast<int>(about.flags.bits()) << ' ' << about.pixels << ' ' << about.flagged << '\n';
      for (std::size_t k = 0; k < flags.size(); ++k)
        if (rgb[3 * k] >= 0)
          out_ << "pixel " << k << ' ' << static_cast<int>(flags[k])
               << rgb_of({rgb[3 * k], rgb[3 * k + 1], rgb[3 * k + 2]}) << '\n';
    }
  }

  std::ofstream out_;
  RecordWriter recording_;
  PlaneReader reader_;
};

std::vector<std::vector<std::byte>> messages_of(PlaneEncoder& encoder, const CapturedPlane& plane, std::int64_t at_ms) {
  const auto messages = encoder.encode(plane, {at_ms * kMs});
  if (!messages) throw std::runtime_error(messages.status().message());
  return {messages->begin(), messages->end()};
}

PlaneEncoder encoder_of(ImageRecipients images) {
  return PlaneEncoder({.images = images, .key_interval = {kKeyInterval_ms * kMs}});
}

/// A capture with a lost message, a late one and a contradiction; another without a texture; and a former one.
void write_planes(const std::filesystem::path& folder) {
  std::mt19937 random(11);
  PlaneAnswers answers(folder);
  answers.ask(0);
  PlaneEncoder encoder = encoder_of(ImageRecipients::all_clients);
  CapturedPlane plane = random_plane(7, 150, 60, 24, random);
  const auto first = messages_of(encoder, plane, 100);
  if (first.size() < 2) throw std::runtime_error("the plane fits one message");
  for (std::size_t k = 1; k < first.size(); ++k) answers.take(first[k], 100);
  answers.ask(110);
  answers.take(first[0], 120);
  answers.take(first[0], 121);
  answers.ask(130);
  plane.texture.radiance[5] = {9, 8, 7};
  plane.lumisphere.radiance[3000] = {1, 2, 3};
  plane.info.mid_exposure = {6'000 * kMs};
  plane.info.T_probe_plane.reset();
  plane.info.gloss_alpha.reset();
  const auto changes = messages_of(encoder, plane, 1'100);
  answers.take(changes[0], 1'100);
  answers.take(first[0], 1'101);
  answers.ask(1'200);
  answers.ask(1'200 + 3 * kKeyInterval_ms);
  // The same capture with other sizes.
  PlaneEncoder other = encoder_of(ImageRecipients::nobody);
  answers.take(messages_of(other, random_plane(7, 0, 8, 8, random), 2'000)[0], 2'000);
  const CapturedPlane next = random_plane(8, 0, 9, 8, random);
  answers.take(messages_of(other, next, 2'100)[0], 2'100);
  answers.ask(2'200);
  answers.take(first[0], 2'300);
  answers.take({std::byte{0xFF}}, 2'400);
  answers.ask(2'500);
  answers.finish();
}

/// A triangle above the plane, which faces it, with the radiance of each vertex; the eye at (0, -0.2, 0.3); rectangles
/// of 0.3 x 0.3 m with 64 x 64 texels.
void write_objects(const std::filesystem::path& path) {
  std::mt19937 random(12);
  std::ofstream out(path);
  PlaneEncoder encoder = encoder_of(ImageRecipients::all_clients);
  CapturedPlane captured = random_plane(9, 64, 30, 10, random);
  captured.info.texture_to_plane = {};
  PlaneReader reader;
  for (const auto& message : messages_of(encoder, captured, 0)) {
    if (!reader.take(message, {0}).ok()) throw std::runtime_error("the plane is not taken");
    out << "take " << hex_of(text_of(message)) << '\n';
  }
  const PlaneAppearance plane = reader.snapshot({0});
  const std::string descriptor = encoded(one_light({0.3F, -0.2F, 1}, {500, 400, 300}, 0.1F));
  const Lighting lighting = Lighting::of(*decode_descriptor(as_bytes(descriptor)));
  out << "lighting " << hex_of(descriptor) << '\n';

  const std::vector<Vec3f> positions = {{0, 0, 0.05F}, {0.06F, 0, 0.05F}, {0, 0.06F, 0.07F}};
  const std::vector<std::uint32_t> indices = {0, 2, 1};
  const std::vector<Radiance> radiance = {{5, 4, 3}, {9, 9, 9}, {1, 2, 3}};
  const ShadowMesh mesh{positions, indices, {}};
  constexpr std::size_t kTexels = 64 * 64;
  std::vector<Radiance> reflected(kTexels);
  std::vector<float> hidden(kTexels);
  Result<PlaneReflector> reflector = PlaneReflector::make();
  const Result<PlaneReflection> about =
      reflector->render(plane, {{0.01, -0.01}, 0.3, 0.3, 64, 64}, {mesh, radiance}, {0, -0.2, 0.3}, reflected, hidden);
  if (!about || about->texels == 0) throw std::runtime_error("nothing is reflected");
  out << "reflection " << static_cast<int>(about->validity) << ' ' << about->texels << '\n';
  std::vector<LightRatio> ratios(kTexels);
  Result<ShadowCaster> caster = ShadowCaster::make();
  if (!caster->cast(lighting, {{}, 0.3, 0.3, 64, 64}, mesh, ratios).ok()) throw std::runtime_error("no shadow");
  for (std::size_t k = 0; k < kTexels; ++k) {
    if (hidden[k] > 0.01F) out << "reflected " << k << rgb_of(reflected[k]) << floats({hidden[k]}) << '\n';
    if (ratios[k].g < 0.99F) out << "shadow " << k << floats({ratios[k].r, ratios[k].g, ratios[k].b}) << '\n';
  }

  PlaneLight light;
  light.update(plane);
  const auto answered = [](const PlaneLightAnswer& a) {
    return " " + std::to_string(static_cast<int>(a.validity)) + " " + std::to_string(int{a.flags.bits()}) + " " +
           std::to_string(static_cast<int>(a.source)) + floats({a.value.r, a.value.g, a.value.b});
  };
  for (const Vec3d& p : {Vec3d{0, 0, 0.05}, {0.1, -0.05, 0.2}, {0.3, 0, 0}, {0, 0, -1}})
    for (const Vec3d& n : {Vec3d{0, 0, -1}, {-1, 0.5, 0.1}, {0, 0, 0}}) {
      for (const PlaneLayers layers : {PlaneLayers::all, PlaneLayers::diffuse, PlaneLayers::specular})
        out << "light" << doubles(p) << doubles(n) << ' ' << static_cast<int>(layers)
            << answered(light.irradiance(p, n, layers)) << '\n';
      out << "light_in" << doubles(p) << doubles(n) << answered(light.irradiance(p, n, lighting)) << '\n';
    }
  if (!out.flush()) throw std::runtime_error("cannot write " + path.string());
}

void write_mutant(std::ofstream& out, const std::string& bytes) {
  const Result<PlaneUpdate> update = decode_plane_update(as_bytes(bytes));
  out << "mutant " << to_string(update.status().code()) << ' ' << hex_of(bytes) << '\n';
  if (!update) return;
  Radiance last;
  for (const PlaneTile& tile : update->tiles)
    if (!tile.radiance.empty()) last = tile.radiance.back();
  out << "update " << update->revision << ' ' << update->layout.texture_edge() << ' ' << update->tiles.size()
      << rgb_of(last) << '\n';
}

void write_mutants(const std::filesystem::path& path) {
  constexpr std::size_t kOfEach = 1'000;
  constexpr int kPoseField = 7;
  std::mt19937 random(78);
  std::ofstream out(path);
  std::vector<std::string> messages;
  for (const int edge : {0, 1, 3}) {
    PlaneEncoder encoder = encoder_of(ImageRecipients::all_clients);
    CapturedPlane plane = random_plane(3, edge, 1 + edge, 1, random);
    messages.push_back(text_of(messages_of(encoder, plane, 0)[0]));
    plane.lumisphere.radiance[0] = {1, 1, 1};
    messages.push_back(text_of(messages_of(encoder, plane, 500)[0]));
  }
  for (const std::string& message : messages) {
    for (std::size_t k = 0; k < kOfEach; ++k)
      write_mutant(out, mutated(message, messages[k % messages.size()], random));
    for (const std::string& bytes : nested_mutants(message, kPoseField)) write_mutant(out, bytes);
  }
  write_mutant(out, std::string(kMaxPlaneMessageBytes + 1, '\x08'));
  if (!out.flush()) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace

void write_plane_answers(const std::filesystem::path& folder) {
  write_planes(folder);
  write_objects(folder / "plane_objects.txt");
  write_mutants(folder / "plane_mutants.txt");
}

}  // namespace lightwell::test
