// The probes of `lightwell field`: those that are named, and those that come and go at a broker.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <lightwell/field.hpp>
#include <lightwell/probe.hpp>

namespace lightwell::tool {

/// Connects on threads of its own, each probe as Probe does. Where a URI has a `+`, it searches the broker every two
/// seconds.
class FieldProbes {
 public:
  explicit FieldProbes(const std::vector<std::string>& uris);
  ~FieldProbes();

  /// A probe that gives no sample, and why.
  struct Absent {
    std::string name, state, reason;
  };

  /// Sets a sample of each probe in the field, all of common_time() where they have one, and removes those that have
  /// left. Returns those without a sample.
  [[nodiscard]] std::vector<Absent> feed(LightField& field);

 private:
  struct Connection {
    std::unique_ptr<Probe> probe;  ///< Null before it answers.
    std::string error;
    bool in_field = false;
  };

  void search(std::vector<std::string> uris);
  void connect(const std::string& uri);
  /// False when the search ends.
  [[nodiscard]] bool pause();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::map<std::string, Connection> connections_;  ///< By URI.
  std::vector<std::string> left_;                  ///< Names to remove from the field.
  std::thread search_;
};

}  // namespace lightwell::tool
