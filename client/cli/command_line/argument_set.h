// What a command takes on its command line: names, help, and how text becomes a value. Knows
// nothing of the library that parses argv.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

// "A:B": half-open, either end may be left out.
struct NumberRange {
  std::uint32_t begin = 0;
  std::uint32_t end = UINT32_MAX;

  bool Contains(std::uint32_t number) const { return number >= begin && number < end; }
  friend bool operator==(const NumberRange&, const NumberRange&) = default;
};

// "T_M,R_DEG": how far a start pose is moved from the truth.
struct Perturbation {
  double translation_m = 0.0;
  double rotation_deg = 0.0;

  friend bool operator==(const Perturbation&, const Perturbation&) = default;
};

// "SIGMA_M[,SEED[,SHARE]]": noise along each axis, and the share of its variance that wanders.
struct SeededNoise {
  double sigma_m = 0.0;
  std::uint64_t seed = 1;
  double wandering = 0.5;

  friend bool operator==(const SeededNoise&, const SeededNoise&) = default;
};

// Text to value; kInvalidArgument saying what was expected. Numbers must be finite and whole text.
Status ParseValue(const std::string& text, std::string& value);
Status ParseValue(const std::string& text, double& value);
Status ParseValue(const std::string& text, std::int32_t& value);
Status ParseValue(const std::string& text, std::uint32_t& value);
Status ParseValue(const std::string& text, std::uint64_t& value);
Status ParseValue(const std::string& text, std::chrono::milliseconds& value);  // seconds, up to 1e6
Status ParseValue(const std::string& text, Eigen::Vector2d& value);            // X,Y
Status ParseValue(const std::string& text, Eigen::Vector3d& value);            // X,Y,Z
Status ParseValue(const std::string& text, NumberRange& value);
Status ParseValue(const std::string& text, Perturbation& value);
Status ParseValue(const std::string& text, SeededNoise& value);
Status ParseValue(const std::string& text, SessionKey& value);  // VEHICLE/SESSION

template <typename T>
Status ParseValue(const std::string& text, std::optional<T>& value) {
  T parsed{};
  ATLAS_RETURN_IF_ERROR(ParseValue(text, parsed));
  value = std::move(parsed);
  return {};
}

struct Argument {
  std::string name;        // "--radius", "-o,--output"; without a dash: positional
  std::string value_name;  // "M"; empty: a flag
  std::string help;
  bool is_required = false;
  std::function<Status(const std::string&)> set;  // the text of a flag is empty
  bool is_repeated = false;                       // `set` is called once each time
};

// The targets outlive the set.
class ArgumentSet {
 public:
  void Flag(std::string name, bool& target, std::string help);

  template <typename T>
  void Optional(std::string name, std::string value_name, T& target, std::string help) {
    Add(std::move(name), std::move(value_name), target, std::move(help), false);
  }
  template <typename T>
  void Required(std::string name, std::string value_name, T& target, std::string help) {
    Add(std::move(name), std::move(value_name), target, std::move(help), true);
  }
  // May be given several times; `target` is what each time said, in order.
  template <typename T>
  void Repeated(std::string name,
                std::string value_name,
                std::vector<T>& target,
                std::string help) {
    const auto append = [&target](const std::string& text) {
      T value{};
      ATLAS_RETURN_IF_ERROR(ParseValue(text, value));
      target.push_back(std::move(value));
      return Status();
    };
    arguments_.push_back(
        {std::move(name), std::move(value_name), std::move(help), false, append, true});
  }
  // One word of `choices`.
  void Choice(std::string name,
              std::vector<std::string> choices,
              std::string& target,
              const std::string& help);

  const std::vector<Argument>& arguments() const { return arguments_; }

 private:
  template <typename T>
  void Add(std::string name, std::string value_name, T& target, std::string help, bool required) {
    arguments_.push_back({std::move(name), std::move(value_name), std::move(help), required,
                          [&target](const std::string& text) {
                            return ParseValue(text, target);
                          }});
  }

  std::vector<Argument> arguments_;
};

}  // namespace atlas
