#include "estimate/specular/gloss_solver.hpp"

#include <cmath>
#include <cstddef>

namespace lightwell::specular {
namespace {

constexpr int kIterations = 30;
/// Standard deviation of the irradiance of directions that no frame saw, relative to their guess.
constexpr double kGuessSigma = 0.5;
/// Time of a node's direction and its neighbours in another grid, and of one element of a vector operation, in
/// operations of WorkBudget.
constexpr std::size_t kNode = 150, kElement = 10;

}  // namespace

EnvironmentParts parts_of(const GlossEnvironment& environment) {
  EnvironmentParts out;
  for (std::size_t cell = 0; cell < environment.radiance.size(); ++cell) {
    const double radiance =
        environment.grid.solid_angle(cell) * static_cast<double>(environment.radiance[cell].luminance());
    const double irradiance = radiance * environment.grid.direction(cell).z;
    const double guess = 1 - static_cast<double>(environment.confidence[cell]);
    out.irradiance += irradiance, out.radiance += radiance;
    out.guessed_irradiance += guess * irradiance, out.guessed_radiance += guess * radiance;
    out.clipped_irradiance += environment.lower_bound[cell] != 0 ? irradiance : 0;
  }
  return out;
}

void GlossSolver::begin(const GlossInput& input, double alpha, int rounds) {
  deconvolution_.reset();
  if (const SpecularBrdf brdf{static_cast<float>(alpha)}; !gloss_ || gloss_->brdf().alpha != brdf.alpha)
    gloss_ = std::make_unique<GlossOperator>(brdf, GlossOperator::levels_for(alpha), GlossOperator::Unbuilt{});
  input_ = &input, rounds_ = rounds, stage_ = Stage::build;
}

bool GlossSolver::step(WorkBudget& budget) {
  if (stage_ == Stage::build) {
    if (!gloss_->build(budget)) return false;
    stage_ = Stage::prepare;
  }
  while (stage_ != Stage::done) {
    const std::size_t work = work_of(stage_);
    if (!budget.has(work)) return false;
    budget.spend(work);
    stage_ = run(stage_);
  }
  return true;
}

std::size_t GlossSolver::work_of(Stage stage) const {
  const std::size_t nodes = gloss_->grid().size(), multiplication = gloss_->work() + kElement * nodes;
  return stage == Stage::prepare || stage == Stage::end_round ? multiplication + kNode * nodes : multiplication;
}

GlossSolver::Stage GlossSolver::run(Stage stage) {
  switch (stage) {
    case Stage::prepare:
      reflected_ = sample(input_->lumisphere, gloss_->grid());
      deconvolution_.emplace(*gloss_, reflected_);
      return Stage::start;
    case Stage::start:
      deconvolution_->start(common_.value);
      iterations_ = rounds_ > 1 ? kIterations / 2 : kIterations;
      return Stage::residual;
    case Stage::residual:
      deconvolution_->compute_residual();
      return Stage::update;
    case Stage::update:
      deconvolution_->update();
      return --iterations_ > 0 ? Stage::residual : Stage::end_round;
    case Stage::end_round:
      if (--rounds_ > 0) {
        fit_common();
        return Stage::start;
      }
      misfit_ = deconvolution_->misfit();
      return Stage::done;
    default:
      return stage;
  }
}

void GlossSolver::fit_common() {
  const GlossEnvironment& environment = deconvolution_->environment();
  const EnvironmentParts parts = parts_of(environment);
  CommonIrradiance irradiance;
  irradiance.slope = deconvolution_->irradiance_slope();
  irradiance.without_common = plane_irradiance(environment);
  for (int c = 0; c < 3; ++c) irradiance.without_common[c] -= static_cast<float>(irradiance.slope) * common_.value[c];
  irradiance.sigma = std::hypot(kGuessSigma * parts.guessed_irradiance, parts.clipped_irradiance);
  common_ = common_radiance(*gloss_, reflected_, input_->diffuse, input_->white, irradiance);
}

}  // namespace lightwell::specular
