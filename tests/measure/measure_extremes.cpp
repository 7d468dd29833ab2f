// Prints one JSON object per line for every row of the figure `extremes`:
//   {"figure": "extremes.ROW", "value": NUMBER, "flagged": SHARE, "answers": N, "refused": N, "unsound": N, "missed":
//   N,
//    "lies": N, "worst_error": E, "worst_over_bound": R, "worst_case": TEXT, ...}
//   measure_extremes [ROW...]   rows whose name begins with one of these; default: all
// Scenes and seeds are fixed in tests/firmware/estimate/extremes; the limits of the rows are in tests/figure_topics.
#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "firmware/estimate/extremes/rows.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;
using namespace lightwell::extremes;

/// Beginnings of the names of the rows to print; empty: all rows.
std::vector<std::string> wanted;

bool asked(const std::string& row) {
  return wanted.empty() ||
         std::any_of(wanted.begin(), wanted.end(), [&](const std::string& begin) { return row.starts_with(begin); });
}

void print(const std::string& row, double value, const Tally& t,
           std::initializer_list<std::pair<const char*, double>> more = {}, const std::string& worst_case = {}) {
  nlohmann::ordered_json out = {{"figure", "extremes." + row},  {"value", value},
                                {"flagged", t.flagged_share()}, {"answers", t.answers},
                                {"refused", t.refused},         {"infinite", t.infinite},
                                {"unsound", t.unsound},         {"silent", t.silent},
                                {"missed", t.missed},           {"lies", t.lies()},
                                {"worst_error", t.worst_error}, {"worst_over_bound", t.worst_over_bound}};
  for (const auto& [name, v] : more) out[name] = v;
  out["nearest_to_bound"] = t.worst_case;
  if (!worst_case.empty()) out["worst_case"] = worst_case;
  if (!t.unsound_case.empty()) out["unsound_case"] = t.unsound_case;
  if (!t.silent_case.empty()) out["silent_case"] = t.silent_case;
  measure::print_line(out);
}

/// For rows without another value, the value is the number of violations ("lies").
void print(const std::string& row, const Tally& t) { print(row, t.lies(), t); }

void print(const std::string& row, const SpotRow& r, std::initializer_list<std::pair<const char*, double>> more = {}) {
  print(row, r.worst_direction_deg, r.tally, more, r.worst_case);
  print(row + ".energy", r.worst_energy, r.tally);
  print(row + ".lost", r.lost, r.tally);
}

void rooms() {
  if (asked("scale")) {
    const ScaleRow r = radiance_scaled(8, Steps::powers_of_two);
    print("scale", r.worst, r.tally, {{"irradiance", r.worst_irradiance}}, r.worst_case);
  }
  if (asked("scale_decades")) {
    const ScaleRow r = radiance_scaled(8, Steps::decades);
    print("scale_decades", r.worst, r.tally, {{"irradiance", r.worst_irradiance}}, r.worst_case);
  }
  if (asked("scale_exposure")) {
    const ScaleRow r = exposure_scaled(6);
    print("scale_exposure", r.worst, r.tally, {}, r.worst_case);
  }
  if (asked("turn")) {
    const TurnRow r = turned_rooms(6, 8);
    print("turn", r.worst, r.tally,
          {{"beyond_both_bounds", r.beyond_both_bounds}, {"direction_deg", r.worst_direction_deg}});
  }
  if (asked("thousand_lights")) print("thousand_lights", thousand_lights(8));
}

void spots() {
  if (asked("hot_pixel")) print("hot_pixel", hot_pixel(60));
  const Place places[] = {Place::pole, Place::seam, Place::lens_edge, Place::between_lenses};
  for (const char* kind : {"pair", "double_sphere", "equirect"})
    for (const int width : {640, 1280}) {
      if (!asked("sun")) continue;
      const std::vector<SpotRow> rows = suns(kind, width, places);
      for (std::size_t i = 0; i < rows.size(); ++i)
        print(std::string("sun.") + name_of(places[i]) + "." + kind + "_" + std::to_string(width), rows[i]);
    }
  struct Size {
    const char* kind;
    int width, height, anywhere;
  };
  for (const Size& size : {Size{"pair", 640, 480, 300}, Size{"pair", 1280, 960, 100},
                           Size{"double_sphere", 640, 480, 100}, Size{"equirect", 1024, 512, 100}})
    for (const double diameter : {0.5, 1.0, 2.0, 5.0})
      for (const Setting setting : kSettings) {
        if (setting != Setting::balanced && size.anywhere != 300) continue;
        const std::string row = formatted("direction.%s_%d.%g_deg.%s", size.kind, size.width, diameter,
                                          std::string(to_string(setting)).c_str());
        if (!asked(row)) continue;
        const RigParameters rig = rig_of(size.kind, size.width, size.height);
        print(row, light_direction(rig, diameter, size.anywhere, setting),
              {{"pixel_deg", RigRenderer(rig).pixel_rad() * 57.29577951}});
      }
}

void closing() {
  for (const double second : {1.0, 0.6})
    for (const PixelFormat format : {PixelFormat::rgb_f32, PixelFormat::rgb8})
      for (const EstimatorConfig& config : {choice(Setting::fast, 0.01), choice(Setting::balanced, 0.01),
                                            choice(Setting::balanced, 0), choice(Setting::exact, 0.01)}) {
        const std::string row = formatted(
            "two_lights.%s_%s.%s%s", second < 1 ? "unlike" : "alike", format == PixelFormat::rgb8 ? "rgb8" : "ideal",
            std::string(to_string(config.setting)).c_str(), config.panorama.epsilon > 0 ? "" : "_all");
        if (!asked(row)) continue;
        const TwoLightsRow r = two_lights(config, format, second);
        print(row, r.worst_energy, r.tally,
              {{"jump", r.worst_jump},
               {"tracks", r.tracks},
               {"swaps", r.swaps},
               {"choices", r.choices},
               {"flickers", r.flickers}},
              r.worst_case);
      }
}

void bad_numbers() {
  if (asked("black")) {
    print("black.floats", all_black(PixelFormat::rgb_f32));
    print("black.codes", all_black(PixelFormat::rgb8));
  }
  if (asked("saturated")) print("saturated", all_saturated());
  for (const Extent extent : {Extent::one_pixel, Extent::one_row, Extent::everywhere}) {
    const std::string row = std::string("nonsense.") + name_of(extent);
    if (asked(row)) print(row, nonsense(extent));
  }
  if (asked("huge")) print("huge", huge());
  if (asked("wire")) print("wire", bright_pixel_on_the_wire());
  if (asked("random_bits")) print("random_bits", random_bits(400));
}

void frames_and_sizes() {
  if (asked("exposure")) {
    const SightRow r = exposures();
    print("exposure", r.worst, r.tally, {}, r.worst_case);
  }
  if (asked("sizes")) {
    const SightRow r = sizes();
    print("sizes", r.worst, r.tally, {}, r.worst_case);
  }
  if (asked("coverage")) {
    const SightRow r = coverage();
    print("coverage", r.worst, r.tally, {}, r.worst_case);
  }
  if (asked("camera_gone")) {
    const SightRow r = camera_gone();
    print("camera_gone", r.worst, r.tally, {}, r.worst_case);
  }
  if (asked("million_frames")) {
    const DriftRow r = many_frames(1'000'000);
    print("million_frames", std::max({r.still, r.noisy, r.lamp}), r.tally,
          {{"still", r.still}, {"noisy", r.noisy}, {"lamp", r.lamp}, {"highest_track", r.highest_track}});
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Errors of the panorama estimator in generated scenes.", "measure_extremes"};
  app.add_option("ROW", wanted, "Rows whose name begins with one of these [all]");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  rooms();
  spots();
  closing();
  bad_numbers();
  frames_and_sizes();
  return 0;
}
