// One update: from samples to the field that queries read.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <lightwell/field.hpp>

#include "field/proxy.hpp"
#include "field/snapshot.hpp"

namespace lightwell::field {

struct NamedSample {
  std::string name;
  FieldSample sample;
};

/// `before` supplies the identities of lights; may be null. `proxy` may be null.
[[nodiscard]] std::shared_ptr<const FieldSnapshot> build_field(const std::vector<NamedSample>& samples,
                                                               const FieldOptions& options,
                                                               std::shared_ptr<const Proxy> proxy,
                                                               const FieldSnapshot* before, HostTime now);

}  // namespace lightwell::field
