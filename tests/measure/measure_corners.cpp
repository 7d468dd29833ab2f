// Noise of tag corners in rendered pictures of a dodecahedron of 10 cm, by the body's width, lens blur, shot noise and
// the method of refinement: RMS error, and chi² per degree of freedom with the stated covariances, against the true
// corners and after the fit of the body's pose. Prints the tables of firmware/pose/README.md.
//   measure_corners            the cells to which the noise model is fitted
//   measure_corners --check    other attitudes, sizes, blurs and noises
//   measure_corners --attitudes    attitudes by the number of tags, for exact and inexact bodies: how many are flagged
//                              as ambiguous, and how many of the others are wrong
//   --json                     one JSON object per cell: figure corners.GRID.METHOD.WIDTHpx.blurB.electronsE, value:
//                              chi² per degree of freedom against the true corners; further numbers:
//                              corner_noise.hpp (CornerStatistics)
//   --edges                    one JSON object per end of an edge (EdgeEnd), to fit the noise model
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/text.hpp>

#include "firmware/pose/corner_noise.hpp"
#include "measure/output.hpp"
#include "tools/command_line.hpp"

namespace {

using namespace lightwell;

struct Grid {
  const char* name;
  PaperKind paper;
  std::uint64_t first_seed;
  int attitudes;
  std::vector<double> widths_px, blurs_px, electrons, decimations;
  double exposure = 1;
  bool srgb = false;
};

/// Bodies of 85 px have cells of two pixels, the smallest that AprilTag reads.
const std::vector<Grid> kFitted = {
    {"white", PaperKind::white, 1000, 10, {85, 120, 200, 400}, {0.5, 1, 2}, {10'000, 1'000}, {1.5}},
    {"grey", PaperKind::grey, 7000, 10, {110, 240}, {0.6, 1.2}, {5'000}, {1.5}},
    {"dark_srgb", PaperKind::white, 8000, 10, {120, 240}, {0.6, 1.2}, {10'000}, {1.5}, 0.1, true},
};
const std::vector<Grid> kChecks = {
    {"white", PaperKind::white, 6000, 10, {100, 150, 300}, {0.7, 1.4}, {3'000, 500}, {1, 3}},
    {"grey", PaperKind::grey, 9000, 10, {130, 200}, {0.8}, {2'000}, {1.5}},
    {"dark_srgb", PaperKind::white, 9500, 10, {160, 300}, {0.8}, {10'000}, {1.5}, 0.05, true},
};

struct Output {
  bool json = false, edges = false;
};

void print(const Grid& grid, std::string_view method, double width_px, const test::CornerCell& cell,
           const test::CornerStatistics& s, const Output& output) {
  if (output.edges) {
    for (const test::EdgeEnd& end : s.ends)
      measure::print_line({{"grid", grid.name},
                           {"method", method},
                           {"width_px", width_px},
                           {"blur_px", cell.blur_px},
                           {"electrons", cell.electrons},
                           {"decimate", cell.decimate},
                           {"cell_px", end.cell_px},
                           {"length_px", end.length_px},
                           {"error_px", end.error_px},
                           {"sigma_px", end.sigma_px}});
  } else if (output.json) {
    measure::print_figure(formatted("corners.%s.%s.%gpx.blur%g.electrons%g.decimate%g", grid.name,
                                    std::string(method).c_str(), width_px, cell.blur_px, cell.electrons, cell.decimate),
                          s.true_chi_square(),
                          {{"fitted_chi_square", s.fitted_chi_square()},
                           {"rms_px", s.rms_px()},
                           {"tags", s.tags},
                           {"refined", s.refined},
                           {"poses", s.poses},
                           {"ambiguous", s.ambiguous},
                           {"three_tags", s.three_tags().poses},
                           {"three_tags_ambiguous", s.three_tags().ambiguous},
                           {"beyond_3_sigma", s.all_tags().beyond_3_sigma},
                           {"pose_normalized", s.pose_normalized / (6 * s.confident)}});
  } else {
    std::printf("| %g | %g | %g | %g | %d | %.3f | %.2f | %.2f | %d of %d | %.2f |\n", width_px, cell.blur_px,
                cell.electrons, cell.decimate, s.tags, s.rms_px(), s.true_chi_square(), s.fitted_chi_square(),
                s.ambiguous, s.poses, s.pose_normalized / (6 * s.confident));
  }
}

void measure_grid(const Grid& grid, const Output& output) {
  SolidOptions solid;
  solid.paper = grid.paper;
  const MarkerBody body = std::move(*make_dodecahedron(solid));
  std::vector<test::CornerScenes> scenes;
  for (const double width_px : grid.widths_px) scenes.emplace_back(body, width_px, grid.attitudes, grid.first_seed);
  for (const auto& [refinement, method] : test::kRefinements) {
    if (!output.json && !output.edges)
      std::printf(
          "\n%s, %s\n\n| body, px | blur, px | electrons | decimation | tags | RMS, px | chi², true | chi², fitted | "
          "ambiguous | pose |\n|---|---|---|---|---|---|---|---|---|---|\n",
          grid.name, std::string(method).c_str());
    for (std::size_t i = 0; i < scenes.size(); ++i)
      for (const double blur_px : grid.blurs_px)
        for (const double electrons : grid.electrons)
          for (const double decimate : grid.decimations) {
            const test::CornerCell cell{blur_px, electrons, decimate, grid.exposure, grid.srgb};
            const test::CornerStatistics s = scenes[i].measure(refinement, cell);
            if (s.tags > 0) print(grid, method, grid.widths_px[i], cell, s, output);
          }
  }
}

/// Default options, as the body tracker uses them for a picture without a prediction. 40 attitudes of each width, each
/// in 16 pictures.
void measure_attitudes(bool json, int attitudes) {
  constexpr double kDegree = std::numbers::pi / 180;
  const std::vector<std::pair<const char*, test::BuildErrors>> builds = {
      {"exact", {}}, {"half", {0.5 * kDegree, 0.25e-3}}, {"rough", {1 * kDegree, 0.5e-3}}};
  const MarkerBody body = std::move(*make_dodecahedron());
  if (!json)
    std::printf(
        "| body | blur, px | tags | poses | flagged | not flagged and beyond 3 sigma | off by more than 5° |\n"
        "|---|---|---|---|---|---|---|\n");
  for (const auto& [name, errors] : builds) {
    std::map<double, std::array<test::AttitudeCounts, 3>> by_blur;
    constexpr int kAtOnce = 20;
    for (const double width_px : {85.0, 110.0, 150.0, 250.0})
      for (int first = 0; first < attitudes; first += kAtOnce) {
        const test::CornerScenes scenes(body, width_px, std::min(kAtOnce, attitudes - first),
                                        20'000 + static_cast<std::uint64_t>(first), errors);
        for (const double blur_px : {0.3, 0.7, 1.2, 2.0})
          for (const double electrons : {10'000.0, 1'000.0})
            for (const int jpeg_quality : {0, 75}) {
              test::CornerCell cell{blur_px, electrons};
              cell.jpeg_quality = jpeg_quality;
              const test::CornerStatistics s = scenes.measure(CornerRefinement::edge_search, cell, {});
              for (std::size_t i = 0; i < s.by_tags.size(); ++i) by_blur[blur_px][i] += s.by_tags[i];
            }
      }
    for (const auto& [blur_px, by_tags] : by_blur)
      for (std::size_t i = 0; i < by_tags.size(); ++i) {
        const test::AttitudeCounts& c = by_tags[i];
        if (c.poses == 0) continue;
        if (json)
          measure::print_figure(formatted("corners.attitudes.%s.blur%g.tags%zu", name, blur_px, i + 1),
                                static_cast<double>(c.beyond_3_sigma) / c.poses,
                                {{"poses", c.poses},
                                 {"ambiguous", c.ambiguous},
                                 {"beyond_3_sigma", c.beyond_3_sigma},
                                 {"mistaken", c.mistaken}});
        else
          std::printf("| %s | %g | %zu | %d | %d | %d | %d |\n", name, blur_px, i + 1, c.poses, c.ambiguous,
                      c.beyond_3_sigma, c.mistaken);
      }
  }
}

}  // namespace

int main(int argc, char** argv) {
  bool check = false, quick = false, attitudes = false;
  Output output;
  CLI::App app{"Noise of tag corners in rendered pictures, relative to their stated covariances.", "measure_corners"};
  app.add_flag("--check", check, "Scenes to which the noise model was not fitted");
  app.add_flag("--attitudes", attitudes, "Ambiguous and wrong attitudes, of exact and inexact bodies");
  app.add_flag("--json", output.json, "One JSON object per cell");
  app.add_flag("--edges", output.edges, "One JSON object per end of an edge");
  app.add_flag("--quick", quick, "Two attitudes and one cell, to test the program");
  if (const auto exit = parse_command_line(app, {argv + 1, argv + argc})) return *exit;
  if (attitudes) {
    measure_attitudes(output.json, quick ? 2 : 40);
    return 0;
  }
  const std::vector<Grid> grids =
      quick ? std::vector<Grid>{{"quick", PaperKind::white, 1000, 2, {200}, {0.6}, {10'000}, {1.5}}}
            : (check ? kChecks : kFitted);
  for (const Grid& grid : grids) measure_grid(grid, output);
  return 0;
}
