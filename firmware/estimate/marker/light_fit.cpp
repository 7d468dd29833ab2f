#include "estimate/marker/light_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <ceres/ceres.h>

#include "estimate/marker/shadow.hpp"

namespace lightwell::marker {
namespace {

/// Steps of the shadow's derivative: a tenth of a degree, and a lamp at a metre that moves by a centimetre.
constexpr double kTurn = 0.002, kInverse = 0.01;
/// Light from all around has a slope even where there is hardly any of it: at least as that of this share of the mean
/// irradiance.
constexpr double kMinAmbientFraction = 0.02;
/// Where the linear parameters are begun: this share of the mean irradiance is taken for light from all around.
constexpr double kInitialAmbientFraction = 0.3;
/// A lamp that lights no sample by more than this factor is told by its shadow alone.
constexpr double kMinFaceIrradiance = 1e-3;
/// Albedo of a table whose light from all around does not tell it.
constexpr double kGroundAlbedo = 0.2;

/// What lies where in the vector of parameters: of each lamp its turn (u, v), its inverse distance where that is free,
/// and its irradiance by channel; of each channel four numbers of light from all around; the table's radiances.
struct Layout {
  struct LightParameters {
    int turn = 0, inverse = -1, irradiance = 0;
  };
  std::vector<LightParameters> lights;
  int ambient = 0, table = -1, size = 0;

  Layout(const std::vector<Distance>& distances, int channels, bool with_table) {
    for (const Distance d : distances) {
      LightParameters lamp;
      lamp.turn = size;
      size += 2;
      if (d == Distance::free) lamp.inverse = size++;
      lamp.irradiance = size;
      size += channels;
      lights.push_back(lamp);
    }
    ambient = size;
    size += 4 * channels;
    if (with_table) {
      table = size;
      size += 1 + static_cast<int>(distances.size());
    }
  }
};

struct LightPose {
  Vec3d direction, u, v;
  double inverse_distance = 0;

  [[nodiscard]] Vec3d turned(double du, double dv) const { return normalized(direction + u * du + v * dv); }
};

/// LightingCostFunction between what was seen and what the parameters make, whitened, and their derivatives.
class LightingCostFunction final : public ceres::CostFunction {
 public:
  LightingCostFunction(const Observations& seen, const Layout& layout, std::vector<LightPose> light_poses, const std::vector<Vec3d>& hull,
              double ambient_gradient_sigma)
      : seen_(seen), layout_(layout), light_poses_(std::move(light_poses)), hull_(hull), slope_(ambient_gradient_sigma) {
    const int table = layout.table >= 0 ? static_cast<int>(seen.table()->size()) : 0;
    set_num_residuals((seen.samples() + 3) * seen.channels() + table);
    mutable_parameter_block_sizes()->push_back(layout.size);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* p = parameters[0];
    double* j = jacobians != nullptr ? jacobians[0] : nullptr;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    RowMajor none(0, 0);
    Eigen::Map<RowMajor> jacobian(j, j != nullptr ? num_residuals() : 0, j != nullptr ? layout_.size : 0);
    if (j != nullptr) jacobian.setZero();
    faces(p, r, j != nullptr ? &jacobian : nullptr);
    if (layout_.table >= 0) table(p, r, j != nullptr ? &jacobian : nullptr);
    return r.allFinite();
  }

  [[nodiscard]] LightPose at(const double* p, std::size_t lamp) const {
    const Layout::LightParameters& where = layout_.lights[lamp];
    LightPose out;
    out.direction = light_poses_[lamp].turned(p[where.turn], p[where.turn + 1]);
    const auto [u, v] = tangent_basis(out.direction);
    out.u = u;
    out.v = v;
    out.inverse_distance = where.inverse >= 0 ? p[where.inverse] : light_poses_[lamp].inverse_distance;
    return out;
  }

 private:
  template <class Jacobian>
  void faces(const double* p, Eigen::Map<Eigen::VectorXd>& r, Jacobian* j) const {
    const std::vector<SurfaceSample>& samples = seen_.of_faces();
    const int n = seen_.samples();
    const std::size_t lights = layout_.lights.size();
    // Of each lamp: its factor, and the factor's derivatives with regard to u, v and the inverse distance.
    Eigen::MatrixXd factors(n, static_cast<Eigen::Index>(4 * lights));
    for (std::size_t k = 0; k < lights; ++k) {
      const Layout::LightParameters& where = layout_.lights[k];
      const double du = p[where.turn], dv = p[where.turn + 1];
      const Vec3d raw = light_poses_[k].direction + light_poses_[k].u * du + light_poses_[k].v * dv;
      const double size = length(raw);
      const Vec3d d = raw * (1 / size);
      // Of the unit vector: what stands across of the step.
      const Vec3d to_u = (light_poses_[k].u - d * dot(d, light_poses_[k].u)) * (1 / size);
      const Vec3d to_v = (light_poses_[k].v - d * dot(d, light_poses_[k].v)) * (1 / size);
      const double w = where.inverse >= 0 ? p[where.inverse] : light_poses_[k].inverse_distance;
      for (int i = 0; i < n; ++i) {
        const SurfaceSample& s = samples[static_cast<std::size_t>(i)];
        const Vec3d q = d - s.position * w;
        const double squared = dot(q, q), cosine = dot(s.normal, q);
        const auto column = static_cast<Eigen::Index>(4 * k);
        if (cosine <= 0) {
          factors.row(i).segment<4>(column).setZero();
          continue;
        }
        const double cube = 1 / (squared * std::sqrt(squared));
        const auto slope = [&](Vec3d dq) { return (dot(s.normal, dq) - 3 * cosine * dot(q, dq) / squared) * cube; };
        factors(i, column) = cosine * cube;
        factors(i, column + 1) = slope(to_u);
        factors(i, column + 2) = slope(to_v);
        factors(i, column + 3) = slope(-s.position);
      }
    }
    Eigen::VectorXd column(n);
    int row = 0;
    for (int c = 0; c < seen_.channels(); ++c, row += n + 3) {
      const double* ambient = p + layout_.ambient + 4 * c;
      for (int i = 0; i < n; ++i) {
        const Vec3d& normal = samples[static_cast<std::size_t>(i)].normal;
        double sum = ambient[0] + ambient[1] * normal.x + ambient[2] * normal.y + ambient[3] * normal.z;
        for (std::size_t k = 0; k < lights; ++k)
          sum += p[layout_.lights[k].irradiance + c] * factors(i, static_cast<Eigen::Index>(4 * k));
        column[i] = sum;
      }
      seen_.whiten(c, column);
      r.segment(row, n) = column - seen_.seen(c);
      const double flat = slope_ * (std::max(0.0, ambient[0]) + kMinAmbientFraction * seen_.mean(c));
      for (int b = 0; b < 3; ++b) r[row + n + b] = ambient[1 + b] / flat;
      if (j == nullptr) continue;
      const auto put = [&](int parameter, double scale, Eigen::Index from) {
        column = scale * factors.col(from);
        seen_.whiten(c, column);
        j->col(parameter).segment(row, n) = column;
      };
      for (std::size_t k = 0; k < lights; ++k) {
        const Layout::LightParameters& where = layout_.lights[k];
        const double irradiance = p[where.irradiance + c];
        const auto first = static_cast<Eigen::Index>(4 * k);
        put(where.turn, irradiance, first + 1);
        put(where.turn + 1, irradiance, first + 2);
        if (where.inverse >= 0) put(where.inverse, irradiance, first + 3);
        put(where.irradiance + c, 1, first);
      }
      for (int b = 0; b < 4; ++b) {
        for (int i = 0; i < n; ++i) {
          const Vec3d& normal = samples[static_cast<std::size_t>(i)].normal;
          column[i] = b == 0 ? 1 : b == 1 ? normal.x : b == 2 ? normal.y : normal.z;
        }
        seen_.whiten(c, column);
        j->col(layout_.ambient + 4 * c + b).segment(row, n) = column;
        if (b > 0) {
          (*j)(row + n + b - 1, layout_.ambient + 4 * c + b) = 1 / flat;
          (*j)(row + n + b - 1, layout_.ambient + 4 * c) = ambient[0] > 0 ? -ambient[b] * slope_ / (flat * flat) : 0;
        }
      }
    }
  }

  template <class Jacobian>
  void table(const double* p, Eigen::Map<Eigen::VectorXd>& r, Jacobian* j) const {
    const GroundObservations& table = *seen_.table();
    const Eigen::Index n = table.size(), row = num_residuals() - n;
    const double ambient = p[layout_.table];
    sum_ = ambient * table.open - table.radiance;
    if (j != nullptr) j->col(layout_.table).segment(row, n) = (table.open * table.weight).matrix();
    for (std::size_t k = 0; k < layout_.lights.size(); ++k) {
      const Layout::LightParameters& where = layout_.lights[k];
      const int own = layout_.table + 1 + static_cast<int>(k);
      const LightPose aim = at(p, k);
      shadow_.light(table, hull_, aim.direction, aim.inverse_distance, light_);
      sum_ += p[own] * light_;
      if (j == nullptr) continue;
      j->col(own).segment(row, n) = (light_ * table.weight).matrix();
      const auto put = [&](int parameter, double step) {
        j->col(parameter).segment(row, n) = ((there_ - back_) * table.weight * (p[own] / (2 * step))).matrix();
      };
      for (int axis = 0; axis < 2; ++axis) {
        for (const double sign : {1.0, -1.0}) {
          const double du = p[where.turn] + (axis == 0 ? sign * kTurn : 0);
          const double dv = p[where.turn + 1] + (axis == 1 ? sign * kTurn : 0);
          shadow_.light(table, hull_, light_poses_[k].turned(du, dv), aim.inverse_distance, sign > 0 ? there_ : back_);
        }
        put(where.turn + axis, kTurn);
      }
      if (where.inverse < 0) continue;
      shadow_.light(table, hull_, aim.direction, aim.inverse_distance + kInverse, there_);
      shadow_.light(table, hull_, aim.direction, aim.inverse_distance - kInverse, back_);
      put(where.inverse, kInverse);
    }
    r.segment(row, n) = (sum_ * table.weight).matrix();
  }

  const Observations& seen_;
  const Layout& layout_;
  std::vector<LightPose> light_poses_;
  const std::vector<Vec3d>& hull_;
  double slope_;
  // Ceres evaluates through a const pointer, one thread at a time here.
  mutable Shadow shadow_;
  mutable Eigen::ArrayXd sum_, light_, there_, back_;
};

LightPose light_pose_of(const PointLight& lamp) {
  const auto [u, v] = tangent_basis(lamp.direction);
  return {lamp.direction, u, v, lamp.inverse_distance};
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The parameters that enter linearly, for the places that `p` holds: least squares, those that must not be negative
/// set to zero.
void solve_linear(const LightingCostFunction& cost_function, const Layout& layout, const Observations& seen,
                  std::vector<double>& p) {
  Eigen::VectorXd r(cost_function.num_residuals());
  RowMajor j(cost_function.num_residuals(), layout.size);
  for (std::size_t i = 0; i < p.size(); ++i)
    if (static_cast<int>(i) >= layout.ambient) p[i] = 0;
  for (const Layout::LightParameters& lamp : layout.lights)
    for (int c = 0; c < seen.channels(); ++c) p[static_cast<std::size_t>(lamp.irradiance + c)] = 0;
  const double* parameters[1] = {p.data()};
  double* jacobians[1] = {j.data()};
  for (int c = 0; c < seen.channels(); ++c)
    p[static_cast<std::size_t>(layout.ambient + 4 * c)] = kInitialAmbientFraction * seen.mean(c);
  (void)cost_function.Evaluate(parameters, r.data(), jacobians);
  std::vector<int> linear;
  for (const Layout::LightParameters& lamp : layout.lights)
    for (int c = 0; c < seen.channels(); ++c) linear.push_back(lamp.irradiance + c);
  for (int i = layout.ambient; i < layout.size; ++i) linear.push_back(i);
  Eigen::MatrixXd part(j.rows(), static_cast<Eigen::Index>(linear.size()));
  for (std::size_t i = 0; i < linear.size(); ++i) part.col(static_cast<Eigen::Index>(i)) = j.col(linear[i]);
  const Eigen::MatrixXd normal = part.transpose() * part;
  // A ridge of a billionth: a lamp that lights nothing has no column.
  const double ridge = 1e-9 * std::max(normal.diagonal().maxCoeff(), 1e-300);
  const Eigen::VectorXd x =
      (normal + ridge * Eigen::MatrixXd::Identity(normal.rows(), normal.cols())).ldlt().solve(-part.transpose() * r);
  for (std::size_t i = 0; i < linear.size(); ++i)
    p[static_cast<std::size_t>(linear[i])] += x[static_cast<Eigen::Index>(i)];
}

/// Irradiances, and light from all around, are not negative.
std::vector<int> nonnegative_parameters(const Layout& layout, int channels) {
  std::vector<int> out;
  for (const Layout::LightParameters& lamp : layout.lights)
    for (int c = 0; c < channels; ++c) out.push_back(lamp.irradiance + c);
  for (int c = 0; c < channels; ++c) out.push_back(layout.ambient + 4 * c);
  if (layout.table >= 0)
    for (int i = layout.table; i < layout.size; ++i) out.push_back(i);
  return out;
}

/// Lamps that light none of the faces: as much stronger than what the faces get as the table shows; their colour is not
/// told.
void set_irradiance_from_shadow(const Observations& seen, Fit& fit) {
  // What the table gets from all around is what the faces get, on the whole: which of it comes from weak lamps is not
  // well known.
  double around = 0;
  for (int c = 0; c < seen.channels(); ++c) around += seen.mean(c) / seen.channels();
  const double albedo =
      around > 0 && fit.ground_ambient > 0 ? fit.ground_ambient / around : kGroundAlbedo / std::numbers::pi;
  for (std::size_t k = 0; k < fit.model.lights.size(); ++k) {
    PointLight& lamp = fit.model.lights[k];
    double most = 0;
    for (const SurfaceSample& s : seen.of_faces())
      most = std::max(most, relative_irradiance(lamp.direction, lamp.inverse_distance, s.position, s.normal));
    if (most < kMinFaceIrradiance) lamp.irradiance.fill(fit.ground_irradiance[k] / albedo);
  }
}

}  // namespace

double Fit::bic() const { return chi_square + parameters * std::log(std::max(observations, 2)); }

Fit fit_lights(const Observations& seen, std::vector<PointLight> lights, std::vector<Distance> distances, ObservationSet observation_set,
              const std::vector<Vec3d>& hull, const FitOptions& options) {
  const int channels = seen.channels();
  const bool with_table = observation_set == ObservationSet::faces_and_ground_plane && seen.table() != nullptr;
  const Layout layout(distances, channels, with_table);
  std::vector<LightPose> light_poses;
  for (const PointLight& lamp : lights) light_poses.push_back(light_pose_of(lamp));
  const double max_inverse_distance = 1 / options.min_distance_m;

  std::vector<double> p(static_cast<std::size_t>(layout.size), 0.0);
  for (std::size_t k = 0; k < lights.size(); ++k)
    if (layout.lights[k].inverse >= 0)
      p[static_cast<std::size_t>(layout.lights[k].inverse)] = std::clamp(lights[k].inverse_distance, 0.0, max_inverse_distance);
  auto* cost_function = new LightingCostFunction(seen, layout, light_poses, hull, options.ambient_gradient_sigma);
  solve_linear(*cost_function, layout, seen, p);
  const std::vector<int> bounded = nonnegative_parameters(layout, channels);
  for (const int i : bounded) p[static_cast<std::size_t>(i)] = std::max(p[static_cast<std::size_t>(i)], 0.0);

  ceres::Problem problem;
  problem.AddResidualBlock(cost_function, nullptr, p.data());
  for (const int i : bounded) problem.SetParameterLowerBound(p.data(), i, 0);
  for (const Layout::LightParameters& lamp : layout.lights) {
    // Within the hemisphere around where it began: the turn's own chart ends there.
    for (int axis = 0; axis < 2; ++axis) {
      problem.SetParameterLowerBound(p.data(), lamp.turn + axis, -1.5);
      problem.SetParameterUpperBound(p.data(), lamp.turn + axis, 1.5);
    }
    if (lamp.inverse < 0) continue;
    problem.SetParameterLowerBound(p.data(), lamp.inverse, 0);
    problem.SetParameterUpperBound(p.data(), lamp.inverse, max_inverse_distance);
  }
  ceres::Solver::Options how;
  // QR: a lamp that lights nothing leaves a column of zeros.
  how.linear_solver_type = ceres::DENSE_QR;
  how.max_num_iterations = options.iterations;
  how.function_tolerance = 1e-7;
  how.logging_type = ceres::SILENT;
  how.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);

  Fit out;
  out.distances = std::move(distances);
  out.table = with_table;
  out.parameters = layout.size;
  out.observations = seen.samples() * channels;
  if (with_table) out.observations += static_cast<int>(seen.table()->size());
  std::vector<LightPose> found;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    found.push_back(cost_function->at(p.data(), k));
    PointLight lamp{found[k].direction, found[k].inverse_distance, {}};
    for (std::size_t c = 0; c < 3; ++c)
      lamp.irradiance[c] =
          p[static_cast<std::size_t>(layout.lights[k].irradiance) + std::min(c, static_cast<std::size_t>(channels - 1))];
    out.model.lights.push_back(lamp);
    if (with_table) out.ground_irradiance.push_back(p[static_cast<std::size_t>(layout.table) + 1 + k]);
  }
  for (std::size_t b = 0; b < 4; ++b)
    for (std::size_t c = 0; c < 3; ++c)
      out.model.ambient[b][c] =
          p[static_cast<std::size_t>(layout.ambient) + 4 * std::min(c, static_cast<std::size_t>(channels - 1)) + b];
  if (with_table) {
    out.ground_ambient = p[static_cast<std::size_t>(layout.table)];
    set_irradiance_from_shadow(seen, out);
  }

  // Around where it ended, so that the turns are those of the tangent plane there.
  const LightingCostFunction around(seen, layout, found, hull, options.ambient_gradient_sigma);
  std::vector<double> there = p;
  for (const Layout::LightParameters& lamp : layout.lights)
    there[static_cast<std::size_t>(lamp.turn)] = there[static_cast<std::size_t>(lamp.turn) + 1] = 0;
  Eigen::VectorXd r(around.num_residuals());
  RowMajor j(around.num_residuals(), layout.size);
  const double* parameters[1] = {there.data()};
  double* jacobians[1] = {j.data()};
  (void)around.Evaluate(parameters, r.data(), jacobians);
  out.chi_square = r.squaredNorm();
  // What nothing is known of keeps a wide prior: a direction a radian, an inverse distance 10/m, an amount all that was
  // seen.
  Eigen::MatrixXd information = j.transpose() * j;
  for (const Layout::LightParameters& lamp : layout.lights) {
    information(lamp.turn, lamp.turn) += 1;
    information(lamp.turn + 1, lamp.turn + 1) += 1;
    if (lamp.inverse >= 0) information(lamp.inverse, lamp.inverse) += 0.01;
  }
  for (int i = 0; i < layout.size; ++i)
    information(i, i) += 1e-12 * std::max(information.diagonal().maxCoeff(), 1e-300);
  const Eigen::MatrixXd covariance = information.ldlt().solve(Eigen::MatrixXd::Identity(layout.size, layout.size));
  const double free = std::max(1, around.num_residuals() - layout.size);
  const double grown = std::max(1.0, out.chi_square / free);
  for (std::size_t k = 0; k < lights.size(); ++k) {
    const Layout::LightParameters& where = layout.lights[k];
    const std::array<int, 3> index = {where.turn, where.turn + 1, where.inverse};
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (index[static_cast<std::size_t>(a)] >= 0 && index[static_cast<std::size_t>(b)] >= 0)
          block(a, b) = grown * covariance(index[static_cast<std::size_t>(a)], index[static_cast<std::size_t>(b)]);
    out.covariance.push_back(block);
  }
  return out;
}

std::vector<double> standardized_residuals(const Observations& seen, const LightModel& model) {
  std::vector<double> out;
  for (int i = 0; i < seen.samples(); ++i) {
    const SurfaceSample& s = seen.of_faces()[static_cast<std::size_t>(i)];
    double most = 0;
    for (int c = 0; c < seen.channels(); ++c) {
      const auto channel = static_cast<std::size_t>(c);
      double sum = model.ambient[0][channel] + model.ambient[1][channel] * s.normal.x +
                   model.ambient[2][channel] * s.normal.y + model.ambient[3][channel] * s.normal.z;
      for (const PointLight& lamp : model.lights)
        sum += lamp.irradiance[channel] * relative_irradiance(lamp.direction, lamp.inverse_distance, s.position, s.normal);
      const double d = seen.deviations(c, i, s.irradiance[channel] - sum);
      if (std::abs(d) > std::abs(most)) most = d;
    }
    out.push_back(most);
  }
  return out;
}

std::vector<double> ground_residuals(const Observations& seen, const Fit& fit, const std::vector<Vec3d>& hull) {
  if (seen.table() == nullptr) return {};
  const GroundObservations& table = *seen.table();
  Eigen::ArrayXd sum = fit.ground_ambient * table.open - table.radiance, light;
  Shadow shadow;
  for (std::size_t k = 0; k < fit.model.lights.size() && k < fit.ground_irradiance.size(); ++k) {
    const PointLight& lamp = fit.model.lights[k];
    shadow.light(table, hull, lamp.direction, lamp.inverse_distance, light);
    sum += fit.ground_irradiance[k] * light;
  }
  sum *= table.weight;
  return {sum.begin(), sum.end()};
}

}  // namespace lightwell::marker
