#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <lightwell/field.hpp>
#include <lightwell/text.hpp>

#include "core/store.hpp"
#include "field/build.hpp"

namespace lightwell {
namespace {

bool is_finite(const Descriptor& d) {
  for (const auto& c : d.radiance.c)
    if (!std::isfinite(c.r + c.g + c.b)) return false;
  return std::ranges::all_of(d.lights, [](const Light& l) {
    return std::isfinite(l.irradiance.r + l.irradiance.g + l.irradiance.b) && lightwell::is_finite(l.direction) &&
           std::isfinite(l.angular_radius_rad + l.distance_m + l.distance_sigma_m) &&
           !std::isnan(l.direction_covariance[0] + l.direction_covariance[2]);
  });
}

bool is_finite(const UncertainPose& pose) {
  const Quat& q = pose.pose.rotation;
  const double norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  bool out = norm2 > 1e-18 && std::isfinite(norm2) && lightwell::is_finite(pose.pose.translation);
  for (std::size_t i = 0; i < 6; ++i) out = out && std::isfinite(pose.covariance[i][i]);
  return out;
}

}  // namespace

Status FieldOptions::validate() const {
  if (!(max_age > Duration{})) return invalid_argument("max_age must be positive");
  if (drop_age < max_age) return invalid_argument("drop_age must not be below max_age");
  if (!(typical_distance_m > 0) || !std::isfinite(typical_distance_m))
    return invalid_argument("typical_distance_m must be positive and finite");
  return {};
}

FieldSample field_sample(const Lighting& light, const UncertainPose& T_world_probe) {
  return {light.descriptor(), T_world_probe, light.mid_exposure(), light.age_uncertainty()};
}

std::optional<HostTime> common_time(std::span<const Lighting> newest, Duration max_lag) {
  const auto counts = [](const Lighting& light) {
    return light.validity() == Validity::valid || light.validity() == Validity::stale;
  };
  std::optional<HostTime> last, common;
  for (const Lighting& light : newest)
    if (counts(light)) last = std::max(last.value_or(light.mid_exposure()), light.mid_exposure());
  for (const Lighting& light : newest)
    if (counts(light) && *last - light.mid_exposure() <= max_lag)
      common = std::min(common.value_or(*last), light.mid_exposure());
  return common;
}

class LightField::Impl {
 public:
  explicit Impl(const FieldOptions& options) : options_(options) {
    auto empty = std::make_shared<field::FieldSnapshot>();
    empty->state = std::make_shared<const FieldState>();
    empty->options = options;
    store.publish(std::move(empty));
  }

  Status set(std::string_view name, FieldSample sample) {
    if (name.empty()) return invalid_argument("a probe in a field needs a name");
    const std::string where(name);
    if (!is_finite(sample.T_world_probe))
      return invalid_argument("the pose of probe " + where +
                              " is not finite or its variance is unknown: measure its rotation and position");
    if (!is_finite(sample.light))
      return invalid_argument("the descriptor of probe " + where + " holds values that are not finite");
    const auto found = samples_.find(name);
    if (found == samples_.end() && samples_.size() >= kMaxFieldProbes)
      return {StatusCode::resource_exhausted, formatted("a field holds at most %zu probes: remove one before adding %s",
                                                        kMaxFieldProbes, where.c_str())};
    sample.light.environment.reset();
    if (found != samples_.end())
      found->second = std::move(sample);
    else
      samples_.emplace(where, std::move(sample));
    return {};
  }

  bool remove(std::string_view name) {
    const auto found = samples_.find(name);
    if (found == samples_.end()) return false;
    samples_.erase(found);
    return true;
  }

  Status set_geometry(const FieldGeometry& geometry) {
    if (geometry.indices.empty()) return proxy_ = nullptr, Status();
    if (geometry.indices.size() % 3 != 0)
      return invalid_argument("the indices of the geometry are not three a triangle");
    if (geometry.indices.size() / 3 > kMaxFieldTriangles)
      return {StatusCode::resource_exhausted,
              formatted("the geometry has %zu triangles, at most %zu are possible: simplify it",
                        geometry.indices.size() / 3, kMaxFieldTriangles)};
    for (const std::uint32_t i : geometry.indices)
      if (i >= geometry.vertices.size())
        return invalid_argument(formatted("index %u of the geometry is beyond its %zu vertices",
                                          static_cast<unsigned>(i), geometry.vertices.size()));
    for (const Vec3f& v : geometry.vertices)
      if (!lightwell::is_finite(v)) return invalid_argument("a vertex of the geometry is not finite");
    return field::Proxy::make(geometry).assign_to(proxy_);
  }

  std::shared_ptr<const FieldState> update(HostTime now) {
    std::vector<field::NamedSample> samples;
    for (const auto& [name, sample] : samples_) samples.push_back({name, sample});
    const auto before = store.read();
    auto made = field::build_field(samples, options_, proxy_, before.get(), now);
    store.publish(made);
    return made->state;
  }

  core::LatestStore<field::FieldSnapshot> store;

 private:
  FieldOptions options_;
  std::map<std::string, FieldSample, std::less<>> samples_;
  std::shared_ptr<const field::Proxy> proxy_;
};

Result<LightField> LightField::make(const FieldOptions& options) {
  if (Status s = options.validate(); !s.ok()) return s.in("field");
  return LightField(std::make_unique<Impl>(options));
}

LightField::LightField(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LightField::LightField(LightField&&) noexcept = default;
LightField& LightField::operator=(LightField&&) noexcept = default;
LightField::~LightField() = default;

Status LightField::set(std::string_view name, FieldSample sample) { return impl_->set(name, std::move(sample)); }
bool LightField::remove(std::string_view name) { return impl_->remove(name); }
Status LightField::set_geometry(const FieldGeometry& geometry) { return impl_->set_geometry(geometry); }
std::shared_ptr<const FieldState> LightField::update(HostTime now) { return impl_->update(now); }
std::shared_ptr<const FieldState> LightField::state() const { return impl_->store.read()->state; }

FieldAnswer LightField::at(Vec3d position, HostTime now) const { return impl_->store.read()->at(position, now); }

bool LightField::at(std::span<const Vec3d> positions, HostTime now, std::span<FieldAnswer> out) const {
  if (positions.size() != out.size()) return false;
  const auto snapshot = impl_->store.read();
  for (std::size_t i = 0; i < positions.size(); ++i) out[i] = snapshot->at(positions[i], now);
  return true;
}

Answer<Irradiance> LightField::irradiance(Vec3d position, Vec3f normal, HostTime now) const {
  return impl_->store.read()->irradiance(position, normal, now);
}

}  // namespace lightwell
