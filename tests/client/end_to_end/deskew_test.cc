// Drives of a sensor that turns while its vehicle drives on, with the real daemon: at 10 m/s walls
// are seen up to 1.25 m from where they are.
#include <fstream>
#include <sstream>

#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

using Arguments = std::vector<std::string>;

const Arguments kAuto = {"--deskew", "auto"};
const Arguments kTold = {"--deskew", "auto", "--revolution", "0.1"};

class DeskewTest : public VehicleTest {
 protected:
  static void SetUpTestSuite() {
    VehicleTest::SetUpTestSuite();
    WriteStreet(shared_root / "seen_at_once", 0);
    WriteStreet(shared_root / "skewed", 0, {}, 0.25);
    WriteStreet(shared_root / "skewed_other_lane", 2, {}, 0.25);
    // Of a sensor that turns ten times a second, two scans of five.
    WriteStreet(shared_root / "thinned", 0, {}, 0.1);
    WriteStreet(shared_root / "thinned_other_lane", 2, {}, 0.1);
  }
  static CommandRun Run(const DaemonProcess& daemon, Arguments arguments, const Arguments& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunAtlas(daemon.address(), arguments);
  }
  static void Map(const DaemonProcess& daemon, const std::string& drive, const Arguments& more) {
    const CommandRun run =
        Run(daemon, {"ingest", (shared_root / drive).string(), "--every", "0"}, more);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
  }

  struct Line {
    double error_m = 0.0;
    double normalized_square = 0.0;  // of four freedoms
    std::string health;
  };
  static std::vector<Line> Localize(const DaemonProcess& daemon,
                                    const std::string& drive,
                                    const Arguments& more) {
    const fs::path csv = shared_root / (drive + ".csv");
    const CommandRun run =
        Run(daemon, {"localize", (shared_root / drive).string(), "--output", csv.string()}, more);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::ifstream in(csv);
    std::string text;
    std::getline(in, text);
    const std::vector<std::string> names = Split(text);
    std::vector<Line> lines;
    while (std::getline(in, text)) {
      const std::vector<std::string> fields = Split(text);
      const auto field = [&](const std::string& name) {
        const auto at = std::find(names.begin(), names.end(), name) - names.begin();
        return fields.at(static_cast<std::size_t>(at));
      };
      lines.push_back({std::stod(field("error_m")), std::stod(field("nees")), field("health")});
    }
    EXPECT_GT(lines.size(), 80U);
    return lines;
  }
  static std::vector<std::string> Split(const std::string& line) {
    std::istringstream in(line);
    std::vector<std::string> fields;
    for (std::string field; std::getline(in, field, ',');) {
      fields.push_back(field);
    }
    return fields;
  }
  // From the third scan on: by then the motion is known.
  static double MeanError_m(const std::vector<Line>& lines) {
    double sum_m = 0.0;
    for (std::size_t i = 2; i < lines.size(); ++i) {
      sum_m += lines[i].error_m;
    }
    return sum_m / static_cast<double>(lines.size() - 2);
  }
};

TEST_F(DeskewTest, ADriveIsLocalizedAsIfItWereSeenAtOnce) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, "seen_at_once", {});
  EXPECT_GT(MeanError_m(Localize(daemon, "skewed_other_lane", {})), 0.1);
  EXPECT_LT(MeanError_m(Localize(daemon, "skewed_other_lane", kAuto)), 0.03);
  EXPECT_GT(MeanError_m(Localize(daemon, "thinned_other_lane", {})), 0.06);
  EXPECT_LT(MeanError_m(Localize(daemon, "thinned_other_lane", kTold)), 0.03);
}

TEST_F(DeskewTest, AMapIsAsSharpAsIfItWereSeenAtOnce) {
  for (const auto& [drive, more] :
       std::map<std::string, Arguments>{{"skewed", kAuto}, {"thinned", kTold}}) {
    const DaemonProcess daemon(NewData(), kSmall);
    Map(daemon, drive, more);
    EXPECT_LT(MeanError_m(Localize(daemon, "seen_at_once", {})), 0.02) << drive;
  }
}

// Nothing is known of the motion before the second scan, nor said.
TEST_F(DeskewTest, TheFirstScansKnowThatTheyAreNotDeskewed) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, "seen_at_once", {});
  const std::vector<Line> lines = Localize(daemon, "skewed_other_lane", kAuto);
  EXPECT_GT(lines[0].error_m, 0.1);
  double sum = 0.0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    ASSERT_EQ(lines[i].health, "good") << i;
    EXPECT_TRUE(i > 2 || lines[i].normalized_square < 15.0) << i;
    sum += lines[i].normalized_square;
  }
  // Also where a turn begins within a scan, which no motion before tells (32 there).
  EXPECT_LT(sum / static_cast<double>(lines.size()), 4.0);
}

TEST_F(DeskewTest, ASkewedDriveIsAnchoredDeskewed) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, "seen_at_once", {});
  const auto anchor = [&](const std::string& session, const Arguments& more) {
    return Run(daemon,
               {"ingest", (shared_root / "skewed_other_lane").string(), "--anchor", "--every", "0",
                "--session", session},
               more);
  };
  const CommandRun bent = anchor("as_it_is", {});
  EXPECT_NE(bent.exit_code, 0);
  EXPECT_FALSE(bent.json().at("anchors").at(0).at("anchored").as_bool());
  const CommandRun straight = anchor("deskewed", kAuto);
  EXPECT_EQ(straight.exit_code, 0) << straight.err;
  EXPECT_TRUE(straight.json().at("anchors").at(0).at("anchored").as_bool());
  EXPECT_LT(straight.json().at("anchors").at(0).at("rms_m").to_number<double>(), 0.03);
}

TEST_F(DeskewTest, ARevolutionIsAShareOfTimesThatAreThere) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, "seen_at_once", {});
  const fs::path untimed = shared_root / "untimed";
  fs::copy(shared_root / "thinned", untimed, fs::copy_options::recursive);
  fs::remove(untimed / "times.txt");
  const fs::path constant = shared_root / "constant";
  fs::copy(shared_root / "thinned", constant, fs::copy_options::recursive);
  std::ofstream times(constant / "times.txt");
  for (int i = 0; i < 1000; ++i) {
    times << "5\n";
  }
  times.close();
  for (const fs::path& drive : {untimed, constant}) {
    for (const std::string command : {"ingest", "localize"}) {
      const CommandRun run = Run(daemon, {command, drive.string()}, kTold);
      EXPECT_NE(run.exit_code, 0) << drive << run.err;
      EXPECT_NE(run.err.find("times"), std::string::npos) << run.err;
    }
  }
}

}  // namespace
}  // namespace atlas
