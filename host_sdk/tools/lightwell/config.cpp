#include <cstdio>

#include <nlohmann/json.hpp>

#include "common.hpp"

namespace lightwell::tool {

int run_config_get(const Options& options) {
  const Result<Probe> probe = connect(options);
  if (!probe.ok()) return fail(probe.status());
  const Result<EstimatorConfig> config = probe->estimator_config();
  if (!config.ok()) return fail(config.status());
  const Result<EstimatorKind> kind = probe->estimator_kind();
  if (!kind.ok()) return fail(kind.status());
  const std::vector<ConfigField> fields = fields_of({*kind, *config});
  if (options.json) {
    nlohmann::ordered_json out;
    out["estimator"] = to_string(*kind);
    for (const ConfigField& f : fields) {
      out[f.name] = f.value;
      if (f.type != ConfigField::Type::number) continue;
      if (const auto number = nlohmann::ordered_json::parse(f.value, nullptr, false); number.is_number())
        out[f.name] = number;
    }
    print_json(out);
    return kOk;
  }
  std::printf("# estimator: %s\n", std::string(to_string(*kind)).c_str());
  for (const ConfigField& f : fields) std::printf("%s=%s\n", f.name.c_str(), f.value.c_str());
  return kOk;
}

int run_config_set(const Options& options) {
  // Report misspelt fields before connecting.
  EstimatorUpdate update;
  for (const std::string& field : options.fields) {
    const auto equals = field.find('=');
    if (equals == std::string::npos)
      return fail(kUsage, "'" + field + "' is not NAME=VALUE; see lightwell config set --help");
    const std::string name = field.substr(0, equals), current = current_option_name(name);
    if (current != name)
      std::fprintf(stderr, "lightwell: field '%s' is now called '%s': the former name is deprecated\n", name.c_str(),
                   current.c_str());
    if (const Status s = set_field(update, name, field.substr(equals + 1)); !s.ok()) return fail(s);
  }
  Result<Probe> probe = connect(options);
  if (!probe.ok()) return fail(probe.status());
  const Status changed = probe->change_estimator(update);
  return changed.ok() ? int{kOk} : fail(changed);
}

}  // namespace lightwell::tool
