// Writes results of the C++ API, for comparison with the other languages.
//   FOLDER/answers.txt      messages, queries and the results of C++; the format is below
//   FOLDER/answers.lwrec    the messages of one probe among them as a recording
//   FOLDER/mutants.txt      damaged messages, and whether C++ accepts them
//   FOLDER/threads.lwrec    3,000 descriptors in 1.5 s, whose light encodes their sequence number
// and what cube_answers.hpp, estimate_answers.hpp, field_answers.hpp and plane_answers.hpp describe.
//
// A line is a word and numbers, %.9g, which gives every float back:
//   message HEX                          the bytes that the following lines are about
//   final                                the following is for the recording's last lighting, from Probe::latest()
//   info sequence units flags bound band lights coverage
//   irradiance x y z  r g b              of the normal x y z
//   radiance x y z roughness  r g b
//   coefficient radiance-or-irradiance(0,1) i  r g b
//   light x y z  r g b  radius  uu uv vv  track  distance sigma  px py pz
//                                        0 0 and 0 0 0 where the distance is not known
//   origin tx ty tz  qx qy qz qw         translation and rotation
//   map levels exponent                  0 levels: none
//   level edge roughness
//   texel level index  r g b
//   rotated qx qy qz qw  x y z  r g b    irradiance at x y z after the rotation q
//   engine NAME choice choice  validity residual  numbers
//                                        a conversion of conventions.h: its enums' numbers (0 where it takes fewer),
//                                        and its struct's fields in order, times of the host left out
// And in mutants.txt:
//   mutant STATUS HEX                    STATUS is the name of a StatusCode; after "ok" follows
//   irradiance x y z  r g b
//   flags bits
//   origin tx ty tz  qx qy qz qw
//   distances d ...                      of each light
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/conventions.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/recording.hpp>
#include <lightwell/text.hpp>

#include "host_sdk/answers/cube_answers.hpp"
#include "host_sdk/answers/estimate_answers.hpp"
#include "host_sdk/answers/field_answers.hpp"
#include "host_sdk/answers/mutation.hpp"
#include "host_sdk/answers/plane_answers.hpp"
#include "host_sdk/scenes.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

constexpr std::array kRoughnesses = {0.0F, 0.02F, 0.35F, 1.0F};

std::string numbers(std::initializer_list<double> values) {
  std::string out;
  for (const double v : values) out += formatted(" %.9g", v);
  return out;
}

template <class Quantity>
std::string numbers(const Rgb<Quantity>& v) {
  return numbers({v.r, v.g, v.b});
}
template <class T>
std::string numbers(Vec3<T> v) {
  return numbers({v.x, v.y, v.z});
}

void write_map(std::ostream& out, const Lighting& light) {
  const auto view = light.environment();
  out << "map" << numbers({view ? double(view->map.levels.size()) : 0, view ? double(view->map.exponent) : 0}) << '\n';
  if (!view) return;
  std::size_t first = 0;
  for (std::size_t k = 0; k < view->map.levels.size(); ++k) {
    const EnvironmentLevel& level = view->map.levels[k];
    out << "level" << numbers({double(level.edge), level.roughness}) << '\n';
    const auto count = static_cast<std::size_t>(level.edge) * static_cast<std::size_t>(level.edge);
    for (std::size_t i = 0; i < count; i += 37)
      out << "texel" << numbers({double(k), double(i)})
          << numbers(texel_radiance(view->map.texels[first + i], view->map.exponent)) << '\n';
    first += count;
  }
}

std::uint32_t bits_of(Flags flags) {
  std::uint32_t bits = 0;
  for (const Flag f : kFlags)
    if (flags.has(f)) bits |= 1U << static_cast<unsigned>(f);
  return bits;
}

/// The fields of a converted value as numbers.
class Fields {
 public:
  Fields& operator<<(double v) {
    text_ += numbers({v});
    return *this;
  }
  template <class T, std::size_t n>
  Fields& operator<<(const std::array<T, n>& values) {
    for (const T& v : values) *this << v;
    return *this;
  }
  Fields& operator<<(const DomPoint& p) { return *this << p.x << p.y << p.z << p.w; }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

Fields fields_of(const WebXrLightEstimate& v) {
  return Fields() << v.sphericalHarmonicsCoefficients << v.primaryLightDirection << v.primaryLightIntensity;
}
Fields fields_of(const ArCoreLightEstimate& v) {
  return Fields() << double(v.state) << v.environmentalHdrMainLightDirection << v.environmentalHdrMainLightIntensity
                  << v.environmentalHdrAmbientSphericalHarmonics;
}
Fields fields_of(const OpenXrLightEstimate& v) {
  return Fields() << double(v.state) << double(v.ambientLight.state) << v.ambientLight.intensity
                  << v.ambientLight.colorCorrection << double(v.sphericalHarmonics.state)
                  << double(v.sphericalHarmonics.kind) << v.sphericalHarmonics.coefficients
                  << double(v.directionalLight.state) << v.directionalLight.intensity << v.directionalLight.direction;
}
Fields fields_of(const ArKitLightEstimate& v) {
  return Fields() << v.sphericalHarmonicsCoefficients << v.primaryLightDirection << v.primaryLightIntensity
                  << v.ambientIntensity << v.ambientColorTemperature;
}
Fields fields_of(const UnityLighting& v) {
  return Fields() << v.sphericalHarmonicsL2 << v.forward << v.color << v.intensity;
}
Fields fields_of(const ThreeLighting& v) {
  return Fields() << v.sh << v.lightProbeIntensity << v.position << v.color << v.intensity;
}
Fields fields_of(const FilamentLighting& v) {
  return Fields() << v.irradiance << v.radiance << v.indirectIntensity << v.direction << v.color << v.intensity
                  << v.sunAngularRadius;
}
Fields fields_of(const UnrealLighting& v) {
  return Fields() << v.R << v.G << v.B << v.forward << v.color << v.intensity << v.lightSourceAngle;
}

template <class T>
void write_engine(std::ostream& out, const char* name, int first, int second, const Converted<T>& converted) {
  out << "engine " << name << numbers({double(first), double(second), double(converted.validity)})
      << numbers({converted.residual.value_or(-1.0F)}) << fields_of(converted.value).text() << '\n';
}

void write_engines(std::ostream& out, const Lighting& light) {
  write_engine(out, "arcore", 0, 0, to_arcore(light));
  write_engine(out, "arkit", 0, 0, to_arkit(light));
  for (const int a : {0, 1}) {
    const auto main = static_cast<MainLight>(a);
    write_engine(out, "webxr", a, 0, to_webxr(light, static_cast<ShSigns>(a)));
    write_engine(out, "filament", a, 0, to_filament(light, main));
    write_engine(out, "unreal", a, 0, to_unreal(light, main));
    for (const int b : {0, 1}) {
      const auto other_main = static_cast<MainLight>(b);
      write_engine(out, "openxr", a, b,
                   to_openxr(light, static_cast<XrSphericalHarmonicsKind>(a), static_cast<ShSigns>(b)));
      write_engine(out, "unity", a, b, to_unity(light, static_cast<UnityPipeline>(a), other_main));
      write_engine(out, "three", a, b, to_three(light, static_cast<ThreeLights>(a), other_main));
    }
  }
}

void write_origin(std::ostream& out, const Pose& origin) {
  const auto& [q, t] = origin;
  out << "origin" << numbers({t.x, t.y, t.z, q.x, q.y, q.z, q.w}) << '\n';
}

void write_answers(std::ostream& out, const Lighting& light) {
  const Descriptor& d = light.descriptor();
  out << "info " << d.sequence
      << numbers({double(d.units), double(bits_of(d.flags)), d.bound.total, double(d.radiance.band),
                  double(d.lights.size()), d.coverage})
      << '\n';
  for (const Vec3f n : directions()) {
    out << "irradiance" << numbers(n) << numbers(light.irradiance(n).value) << '\n';
    for (const float r : kRoughnesses)
      out << "radiance" << numbers(n) << numbers({r}) << numbers(light.radiance(n, r).value) << '\n';
  }
  const IrradianceSh e = irradiance_of(d.radiance);
  for (int i = 0; i < d.radiance.count(); ++i) {
    out << "coefficient" << numbers({0, double(i)}) << numbers(d.radiance.c[static_cast<std::size_t>(i)]) << '\n';
    out << "coefficient" << numbers({1, double(i)}) << numbers(e.c[static_cast<std::size_t>(i)]) << '\n';
  }
  for (const Light& l : light.lights())
    out << "light" << numbers(l.direction) << numbers(l.irradiance) << numbers({l.angular_radius_rad})
        << numbers({l.direction_covariance[0], l.direction_covariance[1], l.direction_covariance[2]}) << ' ' << l.track
        << numbers({l.distance_m, l.distance_sigma_m}) << numbers(light.position(l).value_or(Vec3d{})) << '\n';
  write_origin(out, light.origin());
  write_map(out, light);
  const Quat q = Quat{0.2, -0.5, 0.1, 0.8}.normalized();
  const Lighting turned = light.rotated(q);
  for (const Vec3f n : directions())
    out << "rotated" << numbers({q.x, q.y, q.z, q.w}) << numbers(n) << numbers(turned.irradiance(n).value) << '\n';
  write_engines(out, light);
}

void write_message(std::ostream& out, const std::string& bytes) {
  out << "message " << hex_of(bytes) << '\n';
  Result<Descriptor> d = decode_descriptor(as_bytes(bytes));
  if (!d.ok()) throw std::runtime_error(d.status().message());
  write_answers(out, Lighting::of(std::move(*d)));
}

EnvironmentMap some_map() {
  EnvironmentMap map;
  map.levels = {{16, 0}, {8, 0.3F}, {8, 1}};
  map.exponent = 3;
  map.key_interval_ms = 60'000;
  std::mt19937 random(5);
  for (std::size_t i = 0; i < texel_count(map.levels); ++i)
    map.texels.push_back(static_cast<std::uint32_t>(random() & 0x07FFFFFFU) | 0x70000000U);
  map.key = environment_key(map);
  map.light_tracks = {2, 3};
  map.light_runs = {100, 40, 60, 9};
  for (int i = 0; i < 49; ++i)
    map.light_texels.push_back(static_cast<std::uint32_t>(random() & 0x07FFFFFFU) | 0x90000000U);
  return map;
}

/// Captures of one probe: every band, few and many lights, points and wide caps, a map and changes to it.
std::vector<Descriptor> scenes() {
  std::mt19937 random(20);
  std::uniform_real_distribution<float> any(-1, 1);
  const EnvironmentMap whole = some_map();
  std::vector<Descriptor> out;
  for (int i = 0; i < 14; ++i) {
    Descriptor d = numbered(static_cast<std::uint64_t>(100 + i), 1'000'000'000 + i * 33'000'000);
    d.lights.clear();
    d.units = Units::absolute;
    d.coverage = 0.75F;
    d.bound.total = 0.0125F;
    d.radiance.band = i % (kMaxBand + 1);
    for (int k = 0; k < d.radiance.count(); ++k)
      d.radiance.c[static_cast<std::size_t>(k)] = Radiance{any(random), any(random), any(random)} * 300;
    d.radiance.c[0] = {3000, 2500, 2000};
    for (int k = 0; k < i; ++k) {
      Light l = light({any(random), any(random), any(random)}, Irradiance{9, 8, 7} * (200.0F - 10.0F * float(k)),
                      k == 0 ? 0.0046F : 0.2F * float(k % 8), static_cast<std::uint32_t>(k + 1));
      l.direction_covariance = {1e-4F, k % 2 == 0 ? 0 : 2e-5F, k % 2 == 0 ? 1e-4F : 3e-4F};
      if (k % 3 == 1) {
        l.distance_m = 0.3F * static_cast<float>(k);
        l.distance_sigma_m = 0.0123F;
      }
      d.lights.push_back(l);
    }
    if (i >= 8) d.T_probe_origin = {Quat::about({0, 1, 0}, 0.1 * i), {0.01 * i, -0.02, -0.5}};
    if (i == 5) d.flags.set(Flag::unsure);
    if (i == 12) d.flags.set(Flag::clipped);
    if (i == 3) d.environment = whole;
    if (i == 9) {
      EnvironmentMap changes;
      changes.key = whole.key;
      changes.runs = {5, 2, 200, 1};
      changes.texels = {0x80000001U, 0x80000200U, 0x80040000U};
      changes.light_tracks = {1, 2, 8};
      changes.light_runs = {0, 3, 20, 1};
      changes.light_texels = {0x90000001U, 0x90000200U, 0x90040000U, 0x9FFFFFFFU};
      d.environment = changes;
    }
    out.push_back(std::move(d));
  }
  return out;
}

/// A message with a light for each covariance: positive semi-definite, indefinite as old probes sent them, negative,
/// and so small that rounding to float changes them.
std::string covariance_message() {
  constexpr int kCovariances[][3] = {{5, 12, 36}, {4, 12, 35}, {4, -12, 35}, {0, 5, 63},  {63, -63, 62},
                                     {-5, 3, 7},  {-5, 0, 7},  {1, 63, -2},  {-5, 3, -4}, {1, 3, 9}};
  const auto zigzag = [](int v) { return static_cast<char>(v < 0 ? -2 * v - 1 : 2 * v); };
  std::string bytes = encoded(constant_scene({10, 20, 30}));
  for (const int exponent : {-20, -60, -148, -150})
    for (const auto& m : kCovariances) {
      // Direction 1, 2, -2; irradiance 5, 4, 3; the mantissas.
      std::string light("\x0A\x03\x02\x04\x03\x12\x03\x0A\x08\x06\x2A\x03", 12);
      for (const int mantissa : m) light += zigzag(mantissa);
      light += '\x38';  // covariance_exponent, two bytes where the zigzag number is above 127
      const unsigned z = static_cast<unsigned>(-2 * exponent - 1);
      if (z > 127) light += static_cast<char>(z % 128 + 128);
      light += static_cast<char>(z > 127 ? z / 128 : z);
      bytes += '\x32';  // lights
      bytes += static_cast<char>(light.size());
      bytes += light;
    }
  return bytes;
}

void write_mutant(std::ofstream& out, const std::string& bytes, Vec3f n) {
  Result<Descriptor> d = decode_descriptor(as_bytes(bytes));
  out << "mutant " << to_string(d.status().code()) << ' ' << hex_of(bytes) << '\n';
  if (!d.ok()) return;
  out << "flags " << bits_of(d->flags) << '\n';
  write_origin(out, d->T_probe_origin);
  out << "distances";
  for (const Light& l : d->lights) out << numbers({l.distance_m});
  out << '\n';
  out << "irradiance" << numbers(n) << numbers(Lighting::of(std::move(*d)).irradiance(n).value) << '\n';
}

void write_mutants(const std::string& path, const std::vector<std::string>& messages) {
  constexpr std::size_t kLongest = 1000, kOfEach = 400;
  constexpr int kTimeField = 3;
  std::ofstream out(path);
  std::mt19937 random(77);
  for (std::size_t m = 0; m < messages.size(); ++m) {
    if (messages[m].size() > kLongest) continue;
    for (std::size_t k = 0; k < kOfEach; ++k) {
      const std::string bytes = mutated(messages[m], messages[k % messages.size()], random);
      write_mutant(out, bytes, directions()[k % 10]);
    }
    for (const std::string& bytes : nested_mutants(messages[m], kTimeField)) write_mutant(out, bytes, directions()[0]);
  }
  if (!out.flush()) throw std::runtime_error("cannot write " + path);
}

void write_all(const std::filesystem::path& folder, const std::filesystem::path& vectors) {
  std::filesystem::create_directories(folder);
  const std::string recording = (folder / "answers.lwrec").string();
  std::filesystem::remove(recording);
  std::ofstream out(folder / "answers.txt");
  std::vector<std::filesystem::path> golden;
  for (const auto& entry : std::filesystem::directory_iterator(vectors))
    if (entry.path().extension() == ".bin") golden.push_back(entry.path());
  std::sort(golden.begin(), golden.end());
  if (golden.empty()) throw std::runtime_error("no golden vectors in " + vectors.string());
  std::vector<std::string> messages;
  for (const auto& path : golden) {
    messages.push_back(read_file(path));
    write_message(out, messages.back());
  }
  write_message(out, covariance_message());

  Result<RecordWriter> writer = RecordWriter::open(recording, {RecordingKind::descriptors, "attic", "0.1.0", {}});
  if (!writer.ok()) throw std::runtime_error(writer.status().message());
  for (const Descriptor& d : scenes()) {
    const std::string bytes = encoded(d);
    write_message(out, bytes);
    messages.push_back(bytes);
    if (const Status s = writer->append(d.time.mid_exposure.ns, as_bytes(bytes)); !s.ok())
      throw std::runtime_error(s.message());
  }
  if (const Status s = writer->flush(); !s.ok()) throw std::runtime_error(s.message());

  const Result<Probe> probe = Probe::connect("replay:" + recording + "?speed=0");
  if (!probe.ok()) throw std::runtime_error(probe.status().message());
  std::optional<std::uint64_t> seen;
  for (;;) {
    const Result<Lighting> next = probe->wait_for_next(seen, Duration{60'000'000'000});
    if (!next.ok()) break;
    seen = next->descriptor().sequence;
  }
  out << "final\n";
  write_answers(out, probe->latest());
  if (!out.flush()) throw std::runtime_error("cannot write answers.txt");
  write_mutants((folder / "mutants.txt").string(), messages);
  write_cube_answers(folder, messages);
  write_estimate_answers(folder, messages);
}

void write_many(const std::string& path) {
  std::filesystem::remove(path);
  Result<RecordWriter> writer = RecordWriter::open(path, {RecordingKind::descriptors, "attic", "0.1.0", {}});
  if (!writer.ok()) throw std::runtime_error(writer.status().message());
  for (std::uint64_t i = 1; i <= 3000; ++i) {
    const auto time = static_cast<std::int64_t>(i) * 500'000;
    const std::string bytes = encoded(numbered(i, time));
    if (const Status s = writer->append(time, as_bytes(bytes)); !s.ok()) throw std::runtime_error(s.message());
  }
  if (const Status s = writer->flush(); !s.ok()) throw std::runtime_error(s.message());
}

}  // namespace
}  // namespace lightwell::test

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: make_answers FOLDER VECTORS\n";
    return 2;
  }
  try {
    lightwell::test::write_all(argv[1], argv[2]);
    lightwell::test::write_many(std::string(argv[1]) + "/threads.lwrec");
    lightwell::test::write_plane_answers(argv[1]);
#ifdef LIGHTWELL_HAVE_FIELD
    lightwell::test::write_field_answers(argv[1]);
#endif
  } catch (const std::exception& e) {
    std::cerr << "make_answers: " << e.what() << '\n';
    return 1;
  }
  return 0;
}
