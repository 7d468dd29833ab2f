// The module lightwell_field.so: LightField for liblightwell.so.
#include "c/field_module.hpp"

#include <utility>

namespace lightwell::c {
namespace {

class LoadedField final : public FieldInterface {
 public:
  explicit LoadedField(LightField field) : field_(std::move(field)) {}
  Status set(std::string_view name, FieldSample sample) override { return field_.set(name, std::move(sample)); }
  bool remove(std::string_view name) override { return field_.remove(name); }
  Status set_geometry(const FieldGeometry& geometry) override { return field_.set_geometry(geometry); }
  void update(HostTime now) override { (void)field_.update(now); }
  std::shared_ptr<const FieldState> state() const override { return field_.state(); }
  FieldAnswer at(Vec3d position, HostTime now) const override { return field_.at(position, now); }

 private:
  LightField field_;
};

Result<std::unique_ptr<FieldInterface>> make_field(const FieldOptions& options) {
  Result<LightField> made = LightField::make(options);
  if (!made.ok()) return made.status();
  return std::unique_ptr<FieldInterface>(std::make_unique<LoadedField>(std::move(*made)));
}

}  // namespace
}  // namespace lightwell::c

extern "C" {
// Declared, because a constant would have internal linkage.
[[gnu::visibility("default")]] extern const lightwell::c::FieldEntry lightwell_field_entry;
const lightwell::c::FieldEntry lightwell_field_entry{lightwell::c::kFieldVersion, lightwell::c::make_field};
}
