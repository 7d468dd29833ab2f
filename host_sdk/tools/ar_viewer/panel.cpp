#include "ar_viewer/panel.hpp"

#include <array>
#include <imgui.h>
#include <optional>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>

namespace lightwell::viewer {
namespace {

/// A list of the shadings; `none`: its first line stands for no value.
bool choose_shading(const char* label, std::optional<Shading>& shading, const char* none) {
  const std::string shown(shading ? to_string(*shading) : none);
  if (!ImGui::BeginCombo(label, shown.c_str())) return false;
  bool changed = false;
  if (*none != '\0' && ImGui::Selectable(none, !shading)) {
    shading.reset();
    changed = true;
  }
  for (const Shading each : kShadings)
    if (ImGui::Selectable(std::string(to_string(each)).c_str(), shading == each)) {
      shading = each;
      changed = true;
    }
  ImGui::EndCombo();
  return changed;
}

void edit_material(Material& m) {
  if (ImGui::BeginCombo("preset", "...")) {
    for (const std::string_view name : material_presets())
      if (ImGui::Selectable(std::string(name).c_str())) {
        const Material before = m;
        m = material_preset(name).value_or(before);
        m.texture = before.texture;
        m.normal_map = before.normal_map;
      }
    ImGui::EndCombo();
  }
  ImGui::ColorEdit3("base_color", m.base_color.data(), ImGuiColorEditFlags_Float);
  const auto weight = [](const char* name, float& value) { ImGui::SliderFloat(name, &value, 0, 1); };
  weight("lambert", m.lambert);
  weight("blinn_phong", m.blinn_phong);
  ImGui::SliderFloat("shininess", &m.shininess, 1, 1000, "%.0f", ImGuiSliderFlags_Logarithmic);
  weight("anisotropic", m.anisotropic);
  ImGui::SliderFloat("n_u", &m.n_u, 0, 1000, "%.0f", ImGuiSliderFlags_Logarithmic);
  ImGui::SliderFloat("n_v", &m.n_v, 0, 1000, "%.0f", ImGuiSliderFlags_Logarithmic);
  weight("reflection", m.reflection);
  weight("refraction", m.refraction);
  ImGui::SliderFloat("ior", &m.ior, 1, 2.5F);
  weight("fresnel", m.fresnel);
  ImGui::SliderFloat("fresnel_power", &m.fresnel_power, 1, 10);
  weight("metal_rough", m.metal_rough);
  weight("metallic", m.metallic);
  weight("roughness", m.roughness);
  ImGui::SliderFloat("normal_scale", &m.normal_scale, 0, 3);
  bool vertex = m.lighting == LightingRate::vertex;
  if (ImGui::Checkbox("lighting at vertices", &vertex))
    m.lighting = vertex ? LightingRate::vertex : LightingRate::fragment;
}

}  // namespace

Panel::Panel(GLFWwindow* window) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::StyleColorsDark();
  ImGui_ImplGlfw_InitForOpenGL(window, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Panel::~Panel() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

bool Panel::wants_keyboard() const { return ImGui::GetIO().WantCaptureKeyboard; }

void Panel::draw_light(Viewer& viewer, const FrameReport& report) {
  Scene& scene = viewer.scene();
  if (ImGui::BeginCombo("source", viewer.source().c_str())) {
    for (const auto& [name, light] : scene.lights)
      if (ImGui::Selectable(name.c_str(), name == viewer.source())) {
        const Status status = viewer.set_source(name);
        error_ = status.ok() ? "" : status.message();
      }
    ImGui::EndCombo();
  }
  std::optional<Shading> shading = scene.shading;
  if (choose_shading("shading", shading, "") && shading) scene.shading = *shading;
  (void)choose_shading("right half", scene.side_by_side, "the same");
  ImGui::SliderFloat("exposure", &scene.exposure, 1e-3F, 1e3F, "%.4g", ImGuiSliderFlags_Logarithmic);
  ReflectionStyle& reflection = scene.reflection;
  bool cube_map = reflection.source == ReflectionSource::cube_map;
  bool changed = ImGui::Checkbox("reflections of a cube map (CubeMap360)", &cube_map);
  if (cube_map) changed = ImGui::SliderInt("every frames", &reflection.every_frames, 1, 60) || changed;
  if (changed) {
    reflection.source = cube_map ? ReflectionSource::cube_map : ReflectionSource::prefiltered;
    viewer.renderer().set_reflection(reflection);
  }
  ImGui::Text("light %s, camera %s", std::string(to_string(report.validity)).c_str(),
              report.camera_found ? "found" : "not found: show the tag");
  ImGui::TextWrapped("SDK %.2f ms, shadow %.1f ms, rendering %.1f ms", report.sdk_ms, report.shadow_ms,
                     report.render_ms);
}

void Panel::draw_shadow(Scene& scene) {
  ImGui::SliderFloat("strength", &scene.shadow.strength, 0, 1);
  ImGui::SliderFloat("gain", &scene.shadow.gain, 0, 10);
  bool alpha_test = scene.shadow.display == ShadowDisplay::alpha_test;
  if (ImGui::Checkbox("alpha test (CubeMap360)", &alpha_test))
    scene.shadow.display = alpha_test ? ShadowDisplay::alpha_test : ShadowDisplay::ratio;
  if (alpha_test) ImGui::SliderFloat("alpha_cutoff", &scene.shadow.alpha_cutoff, 0, 1);
  auto fade = static_cast<float>(scene.shadow.stale_fade_s);
  if (ImGui::SliderFloat("stale_fade_s", &fade, 0, 30)) scene.shadow.stale_fade_s = static_cast<double>(fade);
}

void Panel::draw_materials(Viewer& viewer) {
  ObjectSet& objects = viewer.renderer().objects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    std::size_t part = 0;
    for (Material* material : objects.materials(i)) {
      const std::string label = "object " + std::to_string(i) + ", part " + std::to_string(part++);
      if (!ImGui::TreeNode(label.c_str())) continue;
      edit_material(*material);
      ImGui::TreePop();
    }
  }
}

PanelRequests Panel::draw(Viewer& viewer, const FrameReport& report, const std::string& message) {
  PanelRequests requests;
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  ImGui::SetNextWindowPos({8, 8}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({300, 0}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowBgAlpha(0.7F);
  ImGui::Begin("ar_viewer");
  if (ImGui::CollapsingHeader("Light", ImGuiTreeNodeFlags_DefaultOpen)) draw_light(viewer, report);
  if (ImGui::CollapsingHeader("Shadow")) draw_shadow(viewer.scene());
  if (ImGui::CollapsingHeader("Materials")) draw_materials(viewer);
  requests.screenshot = ImGui::Button("screenshot (P)");
  ImGui::SameLine();
  requests.toggle_video = ImGui::Button("video (V)");
  const std::string& shown = error_.empty() ? message : error_;
  if (!shown.empty()) ImGui::TextWrapped("%s", shown.c_str());
  ImGui::TextWrapped("1-4 shading, S side by side, N source, F1 panel, Esc ends");
  ImGui::End();
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  return requests;
}

}  // namespace lightwell::viewer
