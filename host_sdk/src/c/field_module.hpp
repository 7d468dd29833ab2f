// The light field as a module that liblightwell.so loads, so that applications which use none need neither Ceres nor
// Embree. Both are of one build of the tree, which the entry's version says: values of the C++ API pass between them.
#pragma once

#include <memory>
#include <string_view>

#include <lightwell/field.hpp>
#include <lightwell/result.hpp>

namespace lightwell::c {

/// The functions of a LightField.
class FieldInterface {
 public:
  virtual ~FieldInterface() = default;
  [[nodiscard]] virtual Status set(std::string_view name, FieldSample sample) = 0;
  virtual bool remove(std::string_view name) = 0;
  [[nodiscard]] virtual Status set_geometry(const FieldGeometry& geometry) = 0;
  virtual void update(HostTime now) = 0;
  [[nodiscard]] virtual std::shared_ptr<const FieldState> state() const = 0;
  [[nodiscard]] virtual FieldAnswer at(Vec3d position, HostTime now) const = 0;
};

/// What the module exports, under the name lightwell_field_entry.
struct FieldEntry {
  const char* version;  ///< kFieldVersion of the module.
  Result<std::unique_ptr<FieldInterface>> (*make)(const FieldOptions& options);
};

/// Of the tree that it was built from.
inline constexpr const char* kFieldVersion = LIGHTWELL_FIELD_VERSION;

/// The entry of the module, which the first call loads for as long as the process runs. Any thread. failed_precondition
/// with the remedy if it is missing or of another version.
[[nodiscard]] const Result<const FieldEntry*>& field_module();

}  // namespace lightwell::c
