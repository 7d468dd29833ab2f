// A module of the light field, of another version than the library.
struct OtherEntry {
  const char* version;
  void (*make)();
};

extern "C" {
extern const OtherEntry lightwell_field_entry;
const OtherEntry lightwell_field_entry{"0.0.1 ABI 1.0", nullptr};
}
