// C++17 wrapper of the C ABI, with owning objects and strings instead of handles and buffers. For use of a prebuilt
// liblightwell.so with another compiler or standard library: only C crosses the boundary. Applications that build the
// SDK from source use probe.hpp. Works without exceptions; throws none itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lightwell/lightwell.h>
#include <lightwell/plane_appearance.h>
#include <lightwell/plane_objects.h>
#include <lightwell/shadows.h>

namespace lw {

struct [[nodiscard]] Status {
  lw_status code = LW_OK;
  std::string message;

  [[nodiscard]] bool ok() const { return code == LW_OK; }
};

/// The status of a function's return value, with its message; call it before the next call on this thread.
inline Status status_of(lw_status code) {
  if (code == LW_OK) return {};
  std::size_t length = 0;
  const char* const text = lw_last_error(&length);
  return {code, std::string(text, length)};
}

/// A value, or the status that says why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}          // NOLINT: meant to be implicit
  Result(Status status) : status_(std::move(status)) {}  // NOLINT: meant to be implicit

  [[nodiscard]] bool ok() const { return value_.has_value(); }
  explicit operator bool() const { return ok(); }
  /// Only where ok().
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return &*value_; }
  const T* operator->() const { return &*value_; }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  std::optional<T> value_;
  Status status_;
};

/// A struct of the C ABI, zero except for its size.
template <class T>
[[nodiscard]] T sized() {
  T out{};
  out.size = sizeof(T);
  return out;
}

using Vec3 = std::array<float, 3>;

/// One level of the environment map: r, g, b, rows from the top.
struct EnvironmentLevel {
  std::uint32_t edge = 0;
  float roughness = 0;
  std::vector<float> rgb;
};

/// The lighting of one moment. Movable; copy() shares the state. Any number of threads may query it concurrently; it
/// may be filled (Probe::latest(into)) only while no other thread uses it. Queries of a moved-from object return
/// LW_INVALID_QUERY.
class Lighting {
 public:
  /// The only error is resource_exhausted.
  static Result<Lighting> create() {
    lw_lighting* raw = nullptr;
    if (Status s = status_of(lw_lighting_create(&raw)); !s.ok()) return s;
    return Lighting(raw);
  }
  static Result<Lighting> decode(const void* bytes, std::size_t length, std::int64_t age_ns = 0) {
    return filled([&](lw_lighting* into) { return lw_lighting_decode(bytes, length, age_ns, into); });
  }

  Result<Lighting> copy() const {
    return filled([&](lw_lighting* into) { return lw_lighting_copy(get(), into); });
  }
  /// q: x, y, z, w; p_new = q p_old.
  Result<Lighting> rotated(const std::array<double, 4>& q) const {
    return filled([&](lw_lighting* into) { return lw_lighting_rotated(get(), q.data(), into); });
  }
  /// p_new = q p_old + position, m; q: x, y, z, w.
  Result<Lighting> in_world(const std::array<double, 3>& position, const std::array<double, 4>& q) const {
    return filled([&](lw_lighting* into) { return lw_lighting_in_world(get(), position.data(), q.data(), into); });
  }

  [[nodiscard]] lw_lighting_info info() const {
    auto out = sized<lw_lighting_info>();
    (void)lw_lighting_get_info(get(), &out);
    return out;
  }
  /// Why it is not valid; empty if it is.
  [[nodiscard]] std::string reason() const {
    std::array<char, 256> text{};
    (void)lw_lighting_reason(get(), text.data(), text.size(), nullptr);
    return text.data();
  }

  [[nodiscard]] lw_answer irradiance(const Vec3& normal) const {
    auto out = sized<lw_answer>();
    (void)lw_lighting_irradiance(get(), normal.data(), &out);
    return out;
  }
  [[nodiscard]] lw_answer radiance(const Vec3& direction, float roughness) const {
    auto out = sized<lw_answer>();
    (void)lw_lighting_radiance(get(), direction.data(), roughness, &out);
    return out;
  }
  /// values[i] is for normals[i] or directions[i]; both arrays have `count` elements.
  lw_answer irradiance(const Vec3* normals, std::size_t count, Vec3* values) const {
    auto out = sized<lw_answer>();
    (void)lw_lighting_irradiance_batch(get(), floats(normals), 0, count, floats(values), 0, &out);
    return out;
  }
  lw_answer radiance(const Vec3* directions, std::size_t count, float roughness, Vec3* values) const {
    auto out = sized<lw_answer>();
    (void)lw_lighting_radiance_batch(get(), floats(directions), 0, count, roughness, floats(values), 0, &out);
    return out;
  }

  /// Coefficients of all bands of the lighting, (band + 1)².
  [[nodiscard]] std::vector<Vec3> harmonics(lw_quantity quantity) const {
    std::vector<Vec3> out(LW_MAX_COEFFICIENTS);
    std::int32_t band = 0;
    (void)lw_lighting_harmonics(get(), quantity, LW_MAX_BAND, out.front().data(), &band);
    out.resize(static_cast<std::size_t>((band + 1) * (band + 1)));
    return out;
  }
  /// Strongest first.
  [[nodiscard]] std::vector<lw_light> lights() const {
    std::vector<lw_light> out(info().light_count);
    std::size_t count = 0;
    (void)lw_lighting_lights(get(), out.data(), sizeof(lw_light), out.size(), &count);
    return out;
  }
  [[nodiscard]] std::optional<lw_environment> environment() const {
    auto out = sized<lw_environment>();
    (void)lw_lighting_environment(get(), &out);
    if (out.level_count == 0) return std::nullopt;
    return out;
  }
  [[nodiscard]] std::vector<EnvironmentLevel> environment_levels() const {
    std::vector<EnvironmentLevel> out;
    const auto map = environment();
    for (std::uint32_t k = 0; map && k < map->level_count; ++k) {
      EnvironmentLevel level{map->edge[k], map->roughness[k], {}};
      level.rgb.resize(std::size_t{3} * level.edge * level.edge);
      (void)lw_lighting_environment_radiance(get(), k, level.rgb.data(), level.rgb.size());
      out.push_back(std::move(level));
    }
    return out;
  }

  /// For functions without a wrapper, such as lw_lighting_to_unity(light.get(), ...) of conventions.h.
  [[nodiscard]] lw_lighting* get() const { return raw_.get(); }

 private:
  struct Release {
    void operator()(lw_lighting* raw) const { lw_lighting_release(raw); }
  };
  explicit Lighting(lw_lighting* raw) : raw_(raw) {}

  template <class Fill>
  static Result<Lighting> filled(const Fill& fill) {
    Result<Lighting> out = create();
    if (!out.ok()) return out;
    if (Status s = status_of(fill(out->get())); !s.ok()) return s;
    return out;
  }

  // An array of Vec3 has the layout of an array of floats: std::array<float, 3> holds only its elements.
  static const float* floats(const Vec3* v) { return reinterpret_cast<const float*>(v); }
  static float* floats(Vec3* v) { return reinterpret_cast<float*>(v); }

  std::unique_ptr<lw_lighting, Release> raw_;

  friend class Probe;
};
static_assert(sizeof(Vec3) == 3 * sizeof(float), "batch queries need tightly packed triples");

/// Computes shadow textures, as lw_shadow_caster. Movable; one thread at a time.
class ShadowCaster {
 public:
  static Result<ShadowCaster> create(const lw_shadow_options& options = sized<lw_shadow_options>()) {
    lw_shadow_caster* raw = nullptr;
    if (Status s = status_of(lw_shadow_caster_create(&options, &raw)); !s.ok()) return s;
    return ShadowCaster(raw);
  }

  /// `ratios`: `capacity` floats, r, g, b of each texel, rows from the top.
  Result<lw_shadow_summary> cast(const Lighting& light, const lw_shadow_receiver& receiver, const lw_shadow_mesh& mesh,
                                 float* ratios, std::size_t capacity) {
    auto out = sized<lw_shadow_summary>();
    const lw_status code = lw_shadow_caster_cast(raw_.get(), light.get(), &receiver, &mesh, ratios, capacity, &out);
    if (Status s = status_of(code); !s.ok()) return s;
    return out;
  }

 private:
  struct Release {
    void operator()(lw_shadow_caster* raw) const { lw_shadow_caster_release(raw); }
  };
  explicit ShadowCaster(lw_shadow_caster* raw) : raw_(raw) {}
  std::unique_ptr<lw_shadow_caster, Release> raw_;
};

/// One moment of a captured plane. Movable; any number of threads may query it while no thread fills it. Queries of a
/// moved-from object return LW_INVALID_QUERY.
class Plane {
 public:
  /// The only error is resource_exhausted.
  static Result<Plane> create() {
    lw_plane* raw = nullptr;
    if (Status s = status_of(lw_plane_create(&raw)); !s.ok()) return s;
    return Plane(raw);
  }

  [[nodiscard]] lw_plane_info info() const {
    auto out = sized<lw_plane_info>();
    (void)lw_plane_get_info(get(), &out);
    return out;
  }
  /// point: x, y, m; eye: m.
  [[nodiscard]] lw_plane_answer radiance(const std::array<double, 2>& point, const std::array<double, 3>& eye,
                                         lw_plane_layers layers = LW_PLANE_ALL) const {
    auto out = sized<lw_plane_answer>();
    (void)lw_plane_radiance(get(), point.data(), eye.data(), layers, &out);
    return out;
  }
  [[nodiscard]] lw_plane_answer diffuse(const std::array<double, 2>& point) const {
    auto out = sized<lw_plane_answer>();
    (void)lw_plane_diffuse(get(), point.data(), &out);
    return out;
  }
  [[nodiscard]] lw_plane_answer specular(const std::array<double, 3>& to_viewer) const {
    auto out = sized<lw_plane_answer>();
    (void)lw_plane_specular(get(), to_viewer.data(), &out);
    return out;
  }
  /// rgb: 3 width height floats, rows from the top; pixels that do not show the plane are left alone.
  lw_plane_rendering render(const lw_plane_camera& camera, lw_plane_layers layers, float* rgb,
                            std::size_t count) const {
    auto out = sized<lw_plane_rendering>();
    (void)lw_plane_render(get(), &camera, layers, rgb, count, nullptr, 0, &out);
    return out;
  }
  [[nodiscard]] lw_plane_guidance guidance() const {
    auto out = sized<lw_plane_guidance>();
    (void)lw_plane_get_guidance(get(), nullptr, &out);
    return out;
  }

  [[nodiscard]] lw_plane* get() const { return raw_.get(); }

 private:
  struct Release {
    void operator()(lw_plane* raw) const { lw_plane_release(raw); }
  };
  explicit Plane(lw_plane* raw) : raw_(raw) {}
  std::unique_ptr<lw_plane, Release> raw_;
};

/// Collects the messages of one captured plane. One thread at a time.
class PlaneReader {
 public:
  static Result<PlaneReader> create() {
    lw_plane_reader* raw = nullptr;
    if (Status s = status_of(lw_plane_reader_create(&raw)); !s.ok()) return s;
    return PlaneReader(raw);
  }

  Status take(const void* message, std::size_t length, std::int64_t received_ns) {
    return status_of(lw_plane_reader_take(get(), message, length, received_ns));
  }
  Status snapshot(std::int64_t now_ns, Plane& into) {
    return status_of(lw_plane_reader_snapshot(get(), now_ns, into.get()));
  }

  [[nodiscard]] lw_plane_reader* get() const { return raw_.get(); }

 private:
  struct Release {
    void operator()(lw_plane_reader* raw) const { lw_plane_reader_release(raw); }
  };
  explicit PlaneReader(lw_plane_reader* raw) : raw_(raw) {}
  std::unique_ptr<lw_plane_reader, Release> raw_;
};

/// Renders reflections of virtual objects in a captured plane, as lw_plane_reflector. Movable; one thread at a time.
class PlaneReflector {
 public:
  static Result<PlaneReflector> create(const lw_reflection_options& options = sized<lw_reflection_options>()) {
    lw_plane_reflector* raw = nullptr;
    if (Status s = status_of(lw_plane_reflector_create(&options, &raw)); !s.ok()) return s;
    return PlaneReflector(raw);
  }

  /// `reflected`: r, g, b of each texel, rows from the top; `hidden`: one float a texel.
  Result<lw_plane_reflection> render(const Plane& plane, const lw_plane_grid& grid, const lw_radiant_mesh& object,
                                     const std::array<double, 3>& eye, float* reflected, std::size_t reflected_count,
                                     float* hidden, std::size_t hidden_count) {
    auto out = sized<lw_plane_reflection>();
    const lw_status code = lw_plane_reflector_render(raw_.get(), plane.get(), &grid, &object, eye.data(), reflected,
                                                     reflected_count, hidden, hidden_count, &out);
    if (Status s = status_of(code); !s.ok()) return s;
    return out;
  }

 private:
  struct Release {
    void operator()(lw_plane_reflector* raw) const { lw_plane_reflector_release(raw); }
  };
  explicit PlaneReflector(lw_plane_reflector* raw) : raw_(raw) {}
  std::unique_ptr<lw_plane_reflector, Release> raw_;
};

/// The light that a captured plane reflects onto objects, as lw_plane_light. Movable; one thread at a time updates it.
class PlaneLight {
 public:
  using Vector = std::array<double, 3>;
  static Result<PlaneLight> create() {
    lw_plane_light* raw = nullptr;
    if (Status s = status_of(lw_plane_light_create(&raw)); !s.ok()) return s;
    return PlaneLight(raw);
  }

  Status update(const Plane& plane) { return status_of(lw_plane_light_update(raw_.get(), plane.get())); }
  /// By the captured square alone.
  [[nodiscard]] lw_plane_light_answer irradiance(const Vector& point, const Vector& normal,
                                                 lw_plane_layers layers = LW_PLANE_ALL) const {
    auto out = sized<lw_plane_light_answer>();
    (void)lw_plane_light_irradiance(raw_.get(), point.data(), normal.data(), layers, &out);
    return out;
  }
  /// The whole irradiance: the lighting's, with the square's light in its directions.
  [[nodiscard]] lw_plane_light_answer irradiance(const Vector& point, const Vector& normal, const Lighting& in) const {
    auto out = sized<lw_plane_light_answer>();
    (void)lw_plane_light_irradiance_in(raw_.get(), point.data(), normal.data(), in.get(), &out);
    return out;
  }

 private:
  struct Release {
    void operator()(lw_plane_light* raw) const { lw_plane_light_release(raw); }
  };
  explicit PlaneLight(lw_plane_light* raw) : raw_(raw) {}
  std::unique_ptr<lw_plane_light, Release> raw_;
};

/// A connection to a probe. Any thread may call any method; destroy it only while no call is in progress.
class Probe {
 public:
  static Result<Probe> connect(std::string_view uri, const lw_probe_options& options = sized<lw_probe_options>()) {
    lw_probe* raw = nullptr;
    if (Status s = status_of(lw_probe_connect(uri.data(), uri.size(), &options, &raw)); !s.ok()) return s;
    return Probe(raw);
  }

  /// For render loops: fills an existing object. Lock-free, no allocation.
  Status latest(Lighting& into) const { return status_of(lw_probe_latest(get(), into.get())); }
  Result<Lighting> latest() const {
    return Lighting::filled([&](lw_lighting* into) { return lw_probe_latest(get(), into); });
  }
  /// In the world frame: that of the room in which the probe is mounted.
  Result<Lighting> latest_in_world() const {
    return Lighting::filled([&](lw_lighting* into) { return lw_probe_latest_in_world(get(), into); });
  }
  /// host_time_ns: in the clock of lw_now_ns().
  Result<Lighting> at(std::int64_t host_time_ns) const {
    return Lighting::filled([&](lw_lighting* into) { return lw_probe_at(get(), host_time_ns, into); });
  }
  /// Blocks.
  Result<Lighting> wait_for_next(std::optional<std::uint64_t> seen, std::int64_t timeout_ns) const {
    return Lighting::filled(
        [&](lw_lighting* into) { return lw_probe_wait_for_next(get(), seen ? &*seen : nullptr, timeout_ns, into); });
  }

  [[nodiscard]] lw_probe_info info() const {
    auto out = sized<lw_probe_info>();
    (void)lw_probe_get_info(get(), &out);
    return out;
  }
  [[nodiscard]] lw_link_stats stats() const {
    auto out = sized<lw_link_stats>();
    (void)lw_probe_get_stats(get(), &out);
    return out;
  }
  [[nodiscard]] std::string text(lw_probe_text_kind kind) const {
    std::size_t length = 0;
    (void)lw_probe_text(get(), kind, nullptr, 0, &length);
    std::string out(length + 1, '\0');
    (void)lw_probe_text(get(), kind, out.data(), out.size(), &length);
    // The text may have changed between the two calls.
    out.resize(std::char_traits<char>::length(out.c_str()));
    return out;
  }

  Result<lw_estimator_config> estimator_config() const {
    auto out = sized<lw_estimator_config>();
    if (Status s = status_of(lw_probe_get_estimator(get(), &out)); !s.ok()) return s;
    return out;
  }
  Result<lw_estimator_kind> estimator_kind() const {
    lw_estimator_kind out = 0;
    if (Status s = status_of(lw_probe_get_estimator_kind(get(), &out)); !s.ok()) return s;
    return out;
  }
  /// Sets the fields in `fields`, such as LW_FIELD_EPSILON | LW_FIELD_BAND, and leaves the others unchanged.
  Status change_estimator(const lw_estimator_config& config, std::uint64_t fields) {
    return status_of(lw_probe_change_estimator(get(), &config, fields));
  }
  /// Replaces the whole configuration.
  Status set_estimator(const lw_estimator_config& config) { return status_of(lw_probe_set_estimator(get(), &config)); }
  /// Returns the factor that was applied to radiance.
  Result<double> report_lux(double lux, const Vec3& normal) {
    double factor = 0;
    if (Status s = status_of(lw_probe_report_lux(get(), lux, normal.data(), &factor)); !s.ok()) return s;
    return factor;
  }

  /// Fills it with the newest complete state; needs lw_probe_options.plane. Lock-free, no allocation.
  Status plane(Plane& into) const { return status_of(lw_probe_plane(get(), into.get())); }

  [[nodiscard]] lw_probe* get() const { return raw_.get(); }

 private:
  struct Close {
    void operator()(lw_probe* raw) const { lw_probe_close(raw); }
  };
  explicit Probe(lw_probe* raw) : raw_(raw) {}
  std::unique_ptr<lw_probe, Close> raw_;
};

}  // namespace lw
