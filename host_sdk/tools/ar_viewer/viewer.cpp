#include "ar_viewer/viewer.hpp"

#include <optional>
#include <utility>

#include "ar_viewer/background.hpp"
#include "ar_viewer/light_source.hpp"
#include "ar_viewer/light_state.hpp"
#include "ar_viewer/stopwatch.hpp"
#include "ar_viewer/tag_tracker.hpp"

namespace lightwell::viewer {

struct Viewer::Impl {
  Scene scene;
  std::optional<Background> background;
  std::optional<TagTracker> tracker;
  std::unique_ptr<LightSource> light;
  std::string source;
  std::optional<Renderer> renderer;
  std::optional<Stopwatch> stale_for;
  std::optional<Pose> T_world_camera;
  LightState shown;

  Status open_source(const std::string& name) {
    const auto found = scene.lights.find(name);
    if (found == scene.lights.end()) {
      std::string known;
      for (const auto& [each, description] : scene.lights) known += (known.empty() ? "" : ", ") + each;
      return invalid_argument("source '" + name + "' is not in the scene, which has " + known);
    }
    Result<std::unique_ptr<LightSource>> opened = open_light_source(found->second);
    if (!opened.ok()) return opened.status();
    light = std::move(*opened);
    source = name;
    stale_for.reset();
    return {};
  }

  /// The light in the world.
  [[nodiscard]] Lighting world_of(const Lighting& lighting) const {
    if (scene.T_world_probe) return lighting.in_world(*scene.T_world_probe);
    if (const UncertainPose* mounting = lighting.mounting()) return lighting.in_world(*mounting);
    return lighting;
  }

  float presence_of(Validity validity) {
    if (validity != Validity::stale) {
      stale_for.reset();
      return 1;
    }
    if (!stale_for) stale_for.emplace();
    return stale_presence(validity, stale_for->ms() / 1000, scene.shadow.stale_fade_s);
  }
};

Viewer::Viewer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Viewer::Viewer(Viewer&&) noexcept = default;
Viewer& Viewer::operator=(Viewer&&) noexcept = default;
Viewer::~Viewer() = default;

Result<Viewer> Viewer::make(Scene scene, const std::string& source) {
  auto impl = std::make_unique<Impl>();
  impl->scene = std::move(scene);
  if (Status status = impl->open_source(source); !status.ok()) return status;
  if (Status status = Background::open(impl->scene).assign_to(impl->background); !status.ok()) return status;
  if (const auto* tag = std::get_if<TrackedTag>(&impl->scene.pose)) impl->tracker.emplace(*tag, impl->scene.camera);
  if (Status status = Renderer::make(impl->scene).assign_to(impl->renderer); !status.ok()) return status;
  return Viewer(std::move(impl));
}

Result<FrameReport> Viewer::draw_next() {
  Impl& impl = *impl_;
  FrameReport report;
  if (Status status = impl.background->next(); !status.ok()) return status;
  const Stopwatch time;
  if (impl.background->changed()) {
    impl.renderer->set_background(impl.background->picture());
    impl.T_world_camera = impl.tracker ? impl.tracker->find(impl.background->grey()) : std::get<Pose>(impl.scene.pose);
  }
  report.camera_found = impl.T_world_camera.has_value();
  const Stopwatch reading;
  const Lighting lighting = impl.light->next();
  const double reading_ms = reading.ms();
  const Stopwatch light_time;
  const Lighting world = impl.world_of(lighting);
  report.validity = world.validity();
  const float presence = impl.presence_of(report.validity);
  impl.shown = make_light_state(world, report.camera_found ? impl.scene.shading : Shading::off, presence);
  std::optional<LightState> beside;
  if (impl.scene.side_by_side)
    beside = make_light_state(world, report.camera_found ? *impl.scene.side_by_side : Shading::off, presence);
  report.sdk_ms = light_time.ms();

  const int width = impl.scene.camera.width, left = beside ? width / 2 : width;
  const Pose pose = impl.T_world_camera.value_or(Pose{});
  const auto draw = [&](const LightState& light, Columns columns, Half half) {
    const Result<DrawTimes> times = impl.renderer->draw(light, pose, columns, half);
    if (!times.ok()) return times.status();
    report.sdk_ms += times->light_ms;
    report.shadow_ms += times->shadow_ms;
    return Status();
  };
  if (beside)
    if (Status status = draw(*beside, {left, width - left}, Half::right); !status.ok()) return status;
  if (Status status = draw(impl.shown, {0, left}, Half::left); !status.ok()) return status;
  impl.renderer->finish();
  glFinish();
  report.render_ms = time.ms() - reading_ms - report.sdk_ms - report.shadow_ms;
  return report;
}

Status Viewer::draw_shadow() {
  Impl& impl = *impl_;
  if (Status status = impl.renderer->draw_shadow(impl.shown, impl.T_world_camera.value_or(Pose{})); !status.ok())
    return status;
  impl.renderer->finish();
  return {};
}

Scene& Viewer::scene() { return impl_->scene; }
Renderer& Viewer::renderer() { return *impl_->renderer; }
const std::string& Viewer::source() const { return impl_->source; }
Status Viewer::set_source(const std::string& name) { return impl_->open_source(name); }

}  // namespace lightwell::viewer
