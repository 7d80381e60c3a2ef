// Arguments to commands to exit codes, with commands that only record what they were given.
#include "client/cli/command_line/command_line.h"

#include <cstdlib>
#include <sstream>

#include <boost/json/parse.hpp>
#include <gtest/gtest.h>

namespace atlas {
namespace {

struct Recorded {
  double x = 0.0;
  double y = 0.0;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  std::optional<double> height;
  std::uint32_t level = 0;
  std::string color = "red";
  NumberRange range;
  bool is_rebuild = false;
  bool is_json = false;
  Endpoint server;
  bool allows_plaintext = false;
  bool has_tls = false;
  std::optional<std::filesystem::path> atlas_file;
  int runs = 0;
};

class RecordingCommand : public Command {
 public:
  RecordingCommand(std::string name, Recorded& recorded, Status status)
      : name_(std::move(name)), recorded_(recorded), status_(std::move(status)) {}

  std::string Name() const override { return name_; }
  std::string Summary() const override { return "Record"; }
  void Declare(ArgumentSet& arguments) override {
    arguments.Required("X", "M", recorded_.x, "");
    arguments.Required("Y", "M", recorded_.y, "");
    arguments.Optional("--center", "X,Y", recorded_.center, "");
    arguments.Optional("--from", "X,Y,Z", recorded_.from, "");
    arguments.Optional("--height", "M", recorded_.height, "");
    arguments.Optional("--level", "L", recorded_.level, "");
    arguments.Optional("--range", "A:B", recorded_.range, "");
    arguments.Choice("--color", {"red", "blue"}, recorded_.color, "");
    arguments.Flag("--rebuild", recorded_.is_rebuild, "");
  }
  bool ReadsAtlasFiles() const override { return name_ == "point"; }
  Status Run(CommandContext& context) override {
    ++recorded_.runs;
    recorded_.is_json = context.is_json;
    recorded_.server = context.connection.endpoint;
    recorded_.allows_plaintext = context.connection.allow_plaintext;
    recorded_.has_tls = context.connection.tls.has_value();
    recorded_.atlas_file = context.atlas_file;
    return status_;
  }

 private:
  std::string name_;
  Recorded& recorded_;
  Status status_;
};

struct Outcome {
  ExitCode code = ExitCode::kFailure;
  Recorded recorded;
  std::string out;
  std::string err;
};

Outcome RunWith(const std::vector<std::string>& arguments,
                const Status& status = {},
                std::optional<std::string> environment = std::nullopt) {
  Outcome outcome;
  std::vector<std::unique_ptr<Command>> commands;
  commands.push_back(std::make_unique<RecordingCommand>("point", outcome.recorded, status));
  Recorded other;
  commands.push_back(std::make_unique<RecordingCommand>("poses apply", other, status));
  std::ostringstream out;
  std::ostringstream err;
  outcome.code = RunCommandLine(arguments, commands, {out, err, false, std::move(environment)});
  outcome.recorded.runs += other.runs;
  outcome.out = out.str();
  outcome.err = err.str();
  return outcome;
}

TEST(CommandLineTest, NegativeNumbersArePositionals) {
  const Outcome outcome = RunWith({"point", "-0.5", "-3"});
  ASSERT_EQ(outcome.code, ExitCode::kSuccess) << outcome.err;
  EXPECT_EQ(outcome.recorded.x, -0.5);
  EXPECT_EQ(outcome.recorded.y, -3.0);
}

TEST(CommandLineTest, NegativeNumbersInEveryForm) {
  const std::vector<std::pair<std::string, double>> forms = {{"-.5", -0.5},     {"-0", 0.0},
                                                             {"-1e3", -1000.0}, {"-2.5e-1", -0.25},
                                                             {"+4", 4.0},       {"-9.", -9.0}};
  for (const auto& [text, value] : forms) {
    const Outcome outcome = RunWith({"point", "0", text});
    ASSERT_EQ(outcome.code, ExitCode::kSuccess) << text << ": " << outcome.err;
    EXPECT_EQ(outcome.recorded.y, value) << text;
  }
}

TEST(CommandLineTest, NegativeNumbersInLists) {
  const Outcome outcome =
      RunWith({"point", "0", "-3", "--center", "-3,-4", "--from=-1,2,-3", "--height", "-.25"});
  ASSERT_EQ(outcome.code, ExitCode::kSuccess) << outcome.err;
  EXPECT_EQ(outcome.recorded.center, Eigen::Vector2d(-3, -4));
  EXPECT_EQ(outcome.recorded.from, Eigen::Vector3d(-1, 2, -3));
  EXPECT_EQ(outcome.recorded.height, -0.25);
  EXPECT_EQ(RunWith({"point", "0", "0", "--from", "-.1,2,-3"}).recorded.from,
            Eigen::Vector3d(-0.1, 2, -3));
}

TEST(CommandLineTest, OptionsMayStandBetweenPositionals) {
  const Outcome outcome = RunWith({"point", "--json", "-1", "--rebuild", "-2"});
  ASSERT_EQ(outcome.code, ExitCode::kSuccess) << outcome.err;
  EXPECT_EQ(outcome.recorded.y, -2.0);
  EXPECT_TRUE(outcome.recorded.is_json);
  EXPECT_TRUE(outcome.recorded.is_rebuild);
}

TEST(CommandLineTest, UsageErrorsAreTwo) {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"nonsense"},
      {"point"},
      {"point", "1"},
      {"point", "1", "2", "3"},
      {"point", "1", "x"},
      {"point", "1", "nan"},
      {"point", "1", "2", "--bogus"},
      {"point", "1", "2", "--center", "1"},
      {"point", "1", "2", "--center", "1,2,3"},
      {"point", "1", "2", "--center", "1,"},
      {"point", "1", "2", "--level", "-1"},
      {"point", "1", "2", "--level", "1.5"},
      {"point", "1", "2", "--color", "green"},
      {"point", "1", "2", "--range", "5"},
      {"point", "1", "2", "--range", "5:2"},
      {"point", "1", "2", "--server", "nowhere"},
      {"point", "1", "2", "--server", "host:0"},
      {"point", "1", "2", "--server", "host:70000"},
      {"point", "1", "2", "--height", "--json"},
      {"point", "1", "2", "--rebuild=often"},
      {"point", "1", "2", "--json=0"},
      {"point", "1", "2", "--atlas"},
      {"point", "1", "2", "--atlas="},
      {"point", "1", "2", "--atlas", "--json"},
      {"poses", "apply", "1", "2", "--atlas", "a.db"},
      {"poses"},
  };
  for (const auto& arguments : wrong) {
    const Outcome outcome = RunWith(arguments);
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << testing::PrintToString(arguments);
    EXPECT_EQ(outcome.recorded.runs, 0) << testing::PrintToString(arguments);
    EXPECT_TRUE(outcome.out.empty());
    EXPECT_FALSE(outcome.err.empty());
  }
}

TEST(CommandLineTest, UsageErrorsAreJsonWhenAskedFor) {
  const Outcome outcome = RunWith({"point", "--json"});
  const auto error = boost::json::parse(outcome.err).at("error");
  EXPECT_EQ(error.at("code").as_string(), "invalid_argument");
  EXPECT_FALSE(error.at("message").as_string().empty());
}

TEST(CommandLineTest, UnknownCommandIsNamed) {
  EXPECT_NE(RunWith({"nonsense"}).err.find("nonsense"), std::string::npos);
}

TEST(CommandLineTest, HelpAndVersionAreZeroOnStdout) {
  for (const char* flag : {"--help", "--version"}) {
    const Outcome outcome = RunWith({flag});
    EXPECT_EQ(outcome.code, ExitCode::kSuccess);
    EXPECT_FALSE(outcome.out.empty());
    EXPECT_TRUE(outcome.err.empty());
  }
  EXPECT_NE(RunWith({"--help"}).out.find("point"), std::string::npos);
  EXPECT_NE(RunWith({"point", "--help"}).out.find("--center"), std::string::npos);
}

TEST(CommandLineTest, EveryFailureHasItsExitCode) {
  const std::vector<std::pair<StatusCode, int>> codes = {
      {StatusCode::kInvalidArgument, 2},   {StatusCode::kInvalidData, 6},
      {StatusCode::kNotFound, 3},          {StatusCode::kConflict, 4},
      {StatusCode::kUnavailable, 5},       {StatusCode::kTimeout, 5},
      {StatusCode::kResourceExhausted, 1}, {StatusCode::kUnsupported, 1},
      {StatusCode::kPermissionDenied, 1},  {StatusCode::kInternal, 1}};
  for (const auto& [code, exit] : codes) {
    const Outcome outcome = RunWith({"point", "1", "2", "--json"}, {code, "what \"it\" was"});
    EXPECT_EQ(static_cast<int>(outcome.code), exit) << StatusCodeName(code);
    const auto error = boost::json::parse(outcome.err).at("error");
    EXPECT_EQ(error.at("code").as_string(), StatusCodeName(code));
    EXPECT_EQ(error.at("message").as_string(), "what \"it\" was");
    EXPECT_TRUE(outcome.out.empty());
  }
}

TEST(CommandLineTest, ServerComesFromFlagThenEnvironmentThenDefault) {
  EXPECT_EQ(RunWith({"point", "1", "2"}).recorded.server, (Endpoint{"127.0.0.1", 7447}));
  EXPECT_EQ(RunWith({"point", "1", "2"}, {}, "example:9").recorded.server,
            (Endpoint{"example", 9}));
  EXPECT_EQ(RunWith({"point", "1", "2", "--server", "[::1]:80"}, {}, "example:9").recorded.server,
            (Endpoint{"::1", 80}));
  EXPECT_EQ(RunWith({"--server", "a:1", "point", "1", "2"}, {}, "example:9").recorded.server,
            (Endpoint{"a", 1}));
  EXPECT_EQ(RunWith({"point", "1", "2"}, {}, "junk").code, ExitCode::kUsage);
}

TEST(CommandLineTest, PlaintextBeyondLoopbackIsAllowedByFlagOrEnvironment) {
  EXPECT_FALSE(RunWith({"point", "1", "2"}).recorded.allows_plaintext);
  EXPECT_TRUE(RunWith({"point", "1", "2", "--allow-plaintext"}).recorded.allows_plaintext);
  for (const auto& [value, is_allowed] :
       {std::pair("true", true), std::pair("1", true), std::pair("false", false),
        std::pair("0", false), std::pair("", false)}) {
    ASSERT_EQ(setenv("ATLAS_ALLOW_PLAINTEXT", value, 1), 0);
    const Outcome outcome = RunWith({"point", "1", "2"});
    EXPECT_EQ(outcome.code, ExitCode::kSuccess) << value << ": " << outcome.err;
    EXPECT_EQ(outcome.recorded.allows_plaintext, is_allowed) << value;
  }
  ASSERT_EQ(setenv("ATLAS_ALLOW_PLAINTEXT", "perhaps", 1), 0);
  EXPECT_EQ(RunWith({"point", "1", "2"}).code, ExitCode::kUsage);
  ASSERT_EQ(unsetenv("ATLAS_ALLOW_PLAINTEXT"), 0);
}

TEST(CommandLineTest, WhatIsOfTlsIsOfNoUseWithoutIt) {
  for (const std::string flag : {"--tls-name", "--tls-certificate", "--tls-key"}) {
    const Outcome outcome = RunWith({"point", "1", "2", flag, "x"});
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << flag;
    EXPECT_EQ(outcome.recorded.runs, 0) << flag;
    EXPECT_NE(outcome.err.find("--tls-ca"), std::string::npos) << outcome.err;
  }
  EXPECT_TRUE(RunWith({"point", "1", "2", "--tls-ca", "x", "--tls-name", "y"}).recorded.has_tls);
}

TEST(CommandLineTest, AnAtlasFileStandsForTheDaemon) {
  EXPECT_EQ(RunWith({"point", "1", "2"}).recorded.atlas_file, std::nullopt);
  const Outcome outcome = RunWith({"point", "1", "2", "--atlas", "a/b.db"}, {}, "junk");
  EXPECT_EQ(outcome.code, ExitCode::kSuccess) << outcome.err;  // whatever ATLAS_SERVER is
  EXPECT_EQ(outcome.recorded.atlas_file, "a/b.db");
  EXPECT_EQ(RunWith({"point", "1", "2", "--atlas=a.db"}).recorded.atlas_file, "a.db");
  EXPECT_NE(RunWith({"point", "--help"}).out.find("--atlas"), std::string::npos);
  EXPECT_EQ(RunWith({"poses", "apply", "--help"}).out.find("--atlas"), std::string::npos);
}

TEST(CommandLineTest, AnAtlasFileAndADaemonExcludeEachOther) {
  const std::vector<std::vector<std::string>> daemons = {
      {"--server", "a:1"},     {"--server=a:1"},   {"--tls-ca", "x"},     {"--tls-name", "x"},
      {"--tls-certificate=x"}, {"--tls-key", "x"}, {"--token-file", "x"}, {"--allow-plaintext"}};
  for (const auto& daemon : daemons) {
    std::vector<std::string> arguments = {"point", "1", "2", "--atlas", "a.db"};
    arguments.insert(arguments.end(), daemon.begin(), daemon.end());
    const Outcome outcome = RunWith(arguments);
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << daemon.front();
    EXPECT_EQ(outcome.recorded.runs, 0);
    const std::string flag = daemon.front().substr(0, daemon.front().find('='));
    EXPECT_NE(outcome.err.find(flag), std::string::npos) << outcome.err;
  }
  const Outcome before = RunWith({"--server", "a:1", "point", "1", "2", "--atlas", "a.db"});
  EXPECT_EQ(before.code, ExitCode::kUsage);
}

TEST(CommandLineTest, NoiseMayHaveASeed) {
  SeededNoise noise;
  ASSERT_TRUE(ParseValue("0.5", noise).ok());
  EXPECT_EQ(noise, (SeededNoise{0.5, 1}));
  ASSERT_TRUE(ParseValue("2,18446744073709551615", noise).ok());
  EXPECT_EQ(noise, (SeededNoise{2.0, UINT64_MAX}));
  ASSERT_TRUE(ParseValue("2,3,0", noise).ok());
  EXPECT_EQ(noise, (SeededNoise{2.0, 3, 0.0}));
}

TEST(CommandLineTest, CommandsOfTwoWords) {
  EXPECT_EQ(RunWith({"poses", "apply", "1", "-2"}).recorded.runs, 1);
}

}  // namespace
}  // namespace atlas
