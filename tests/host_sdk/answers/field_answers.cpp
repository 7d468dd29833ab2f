#include "host_sdk/answers/field_answers.hpp"

#include <array>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/codec.hpp>
#include <lightwell/field.hpp>
#include <lightwell/text.hpp>

#include "host_sdk/answers/mutation.hpp"
#include "host_sdk/field/field_scenes.hpp"
#include "host_sdk/scenes.hpp"

namespace lightwell::test {
namespace {

constexpr double kPositionSigma = 2e-3, kOrientationSigma = 1e-3;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kSecond = 1'000'000'000;

class FieldAnswers {
 public:
  explicit FieldAnswers(const std::filesystem::path& path) : out_(path) {}

  void start() {
    field_ = std::move(LightField::make().value());
    out_ << "field\n";
  }

  /// What arrives of a descriptor, as a sample: encoded and decoded.
  void set(const std::string& name, Vec3d place, Quat turn, const Descriptor& light, std::int64_t ns) {
    FieldSample sample = sample_at(place, light, turn, {ns});
    const std::string bytes = encoded(sample.light);
    sample.light = decode_descriptor(as_bytes(bytes)).value();
    for (std::size_t i = 0; i < 6; ++i) {
      const double sigma = i < 3 ? kOrientationSigma : kPositionSigma;
      sample.T_world_probe.covariance[i][i] = sigma * sigma;
    }
    out_ << "sample " << name;
    write(std::array{place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w, kPositionSigma, kOrientationSigma});
    out_ << ' ' << ns << ' ' << hex_of(bytes) << '\n';
    require(field_->set(name, std::move(sample)));
  }

  void set_geometry(const std::array<Vec3f, 3>& triangle) {
    constexpr std::array<std::uint32_t, 3> kIndices{0, 1, 2};
    require(field_->set_geometry({triangle, kIndices}));
    out_ << "triangle";
    for (const Vec3f& v : triangle) write(std::array{v.x, v.y, v.z});
    out_ << '\n';
  }

  void update(std::int64_t now) {
    const auto state = field_->update({now});
    out_ << "update " << now << ' ' << state->lights.size() << ' ' << state->probes.size() << ' '
         << static_cast<int>(state->units) << '\n';
    for (const FieldLight& l : state->lights) {
      out_ << "light " << l.id << ' ' << int{l.placed} << ' ' << l.probes;
      write(std::array{l.position.x, l.position.y, l.position.z});
      write(l.position_covariance);
      write(std::array{l.direction.x, l.direction.y, l.direction.z, l.direction_sigma_rad});
      write(std::array{l.intensity.r, l.intensity.g, l.intensity.b});
      for (const Irradiance& g : l.intensity_gradient) write(std::array{g.r, g.g, g.b});
      write(std::array{l.radius});
      out_ << '\n';
    }
    for (const FieldProbe& p : state->probes) {
      out_ << "probe " << p.name << ' ' << static_cast<int>(p.state);
      write(std::array{p.position.x, p.position.y, p.position.z, p.scale});
      out_ << ' ' << p.lights << ' ' << p.matched << ' ' << p.ambiguous << '\n';
    }
  }

  void ask(Vec3d p, std::int64_t now) {
    const FieldAnswer answer = field_->at(p, {now});
    const Descriptor& d = answer.light.descriptor();
    out_ << "at";
    write(std::array{p.x, p.y, p.z});
    out_ << ' ' << now << ' ' << static_cast<int>(answer.light.validity()) << ' ' << answer.light.age().ns;
    write(std::array{d.bound.total});
    unsigned flags = 0, field_flags = 0;
    for (const Flag f : kFlags)
      if (d.flags.has(f)) flags |= 1U << static_cast<unsigned>(f);
    for (const FieldFlag f : kFieldFlags)
      if (answer.flags.has(f)) field_flags |= 1U << static_cast<unsigned>(f);
    out_ << ' ' << flags << ' ' << field_flags;
    write(std::array{answer.nearest_probe_m});
    out_ << ' ' << d.lights.size() << ' ' << d.radiance.band << '\n';
    for (const Vec3f n : {Vec3f{0, 1, 0}, Vec3f{0.6F, 0, -0.8F}, Vec3f{}}) {
      const auto e = answer.light.irradiance(n);
      out_ << "irradiance";
      write(std::array{p.x, p.y, p.z});
      write(std::array{n.x, n.y, n.z});
      out_ << ' ' << now << ' ' << static_cast<int>(e.validity);
      write(std::array{e.value.r, e.value.g, e.value.b});
      out_ << '\n';
    }
  }

  void finish() {
    if (!out_.flush()) throw std::runtime_error("cannot write fields.txt");
  }

 private:
  static void require(const Status& status) {
    if (!status.ok()) throw std::runtime_error(status.message());
  }

  /// Every float and double can be read back.
  template <class T, std::size_t n>
  void write(const std::array<T, n>& values) {
    for (const T v : values) out_ << formatted(sizeof(T) == sizeof(double) ? " %.17g" : " %.9g", double{v});
  }

  std::ofstream out_;
  std::optional<LightField> field_;
};

}  // namespace

void write_field_answers(const std::filesystem::path& folder) {
  const FieldScene room{.lamps = {{{0.4, 2.2, -0.3}}, {{-1.1, 1.9, 0.9}, {1, 2, 4}}}, .sun = {2, 2, 1.5F}};
  const std::vector<Vec3d> points{{0, 1, 0},        {0.8, 0.5, -0.4}, {-1.5, 1.2, -1.4},
                                  {0.4, 2.2, -0.3}, {9, 1, 9},        {kNan, 0, 0}};
  FieldAnswers answers(folder / "fields.txt");
  answers.start();
  answers.update(kSecond);
  answers.ask({0, 1, 0}, kSecond);  // Without probes.
  const std::vector<Vec3d> places = four_places();
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Quat turn = Quat::about({0, 1, 0}, 0.7 * static_cast<double>(k));
    answers.set("p" + std::to_string(k), places[k], turn, room.at(places[k]), kSecond);
    answers.update(kSecond + 1000);
    for (const Vec3d& p : points) answers.ask(p, kSecond + 1000);
  }
  answers.ask(points[0], 10 * kSecond);  // Stale.
  answers.set("other", {-1.4, 1.2, -1.3}, {}, FieldScene{.ambient = 9}.at({}), 2 * kSecond);
  answers.set("late", {1, 1, 1}, {}, room.at({1, 1, 1}), 99 * kSecond);
  answers.update(2 * kSecond);
  for (const Vec3d& p : points) answers.ask(p, 2 * kSecond);
  if (field_has_geometry()) {
    answers.set_geometry({Vec3f{-1, 1.6F, -1}, {2, 1.6F, -1}, {0, 1.6F, 2}});
    answers.update(2 * kSecond);
    for (const Vec3d& p : points) answers.ask(p, 2 * kSecond);
  }
  answers.finish();
}

}  // namespace lightwell::test
