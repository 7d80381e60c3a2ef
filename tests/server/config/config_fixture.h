// Reads configurations as the daemon does, from flags, variables and a file of its own.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/config/daemon_command.h"

namespace atlas {

class DaemonConfigTest : public ::testing::Test {
 protected:
  DaemonConfigTest() {
    std::string name = (std::filesystem::temp_directory_path() / "atlas_config_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("cannot make " + name);
    }
    directory_ = name;
  }
  ~DaemonConfigTest() override {
    for (const std::string& name : variables_) {
      ::unsetenv(name.c_str());
    }
    std::filesystem::remove_all(directory_);
  }

  std::string File(const std::string& text) const {
    std::string path = (directory_ / "atlasd.toml").string();
    std::ofstream(path) << text;
    return path;
  }
  void SetVariable(const std::string& name, const std::string& value) {
    ::setenv(name.c_str(), value.c_str(), 1);
    variables_.push_back(name);
  }
  static Result<DaemonCommand> Parse(const std::vector<std::string>& arguments) {
    std::vector<const char*> argv = {"atlasd"};
    for (const std::string& argument : arguments) {
      argv.push_back(argument.c_str());
    }
    return ParseDaemonCommand(static_cast<int>(argv.size()), argv.data());
  }
  // The message of a refused configuration.
  static std::string Refusal(const std::vector<std::string>& arguments) {
    const auto command = Parse(arguments);
    if (command) {
      return "accepted";
    }
    EXPECT_EQ(command.error().code(), StatusCode::kInvalidArgument);
    return command.error().message();
  }
  std::string RefusedFile(const std::string& text) const {
    return Refusal({"--config", File(text)});
  }

  std::filesystem::path directory_;
  std::vector<std::string> variables_;
};

}  // namespace atlas
