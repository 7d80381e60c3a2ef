// `atlas simulate`: a drive through a world that is built in or a mesh, as a folder of scans.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "client/cli/command_line/interruption.h"
#include "client/cli/commands/drive/drive_commands.h"
#include "client/cli/commands/drive/simulation_request.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/progress_bar.h"
#include "core/simulation/drive_writer.h"

namespace atlas {
namespace {

// Of the scans that are written, from each to the next; jumps are no way.
double MetresOf(const SimulatedDrive& drive, const DriveWriteOptions& options) {
  constexpr double kJump_m = 10.0;
  double metres = 0.0;
  for (std::size_t i = options.begin + 1; i < std::min(drive.scans(), options.end); ++i) {
    const double step_m =
        (drive.sensor_pose(i).translation() - drive.sensor_pose(i - 1).translation()).norm();
    if (step_m <= kJump_m) metres += step_m;
  }
  return metres;
}

class SimulateCommand : public Command {
 public:
  std::string Name() const override { return "simulate"; }
  std::string Summary() const override { return "Simulate a drive and write its scans"; }

  void Declare(ArgumentSet& arguments) override {
    request_.Declare(arguments);
    arguments.Optional("--range", "A:B", range_,
                       "Write scans A to before B alone, numbered from 0 [all]");
    arguments.Optional("--drift", "K", drift_seed_,
                       "Poses as an odometry has them: 1 % and 0.5 deg a 100 m off, by seed K; the "
                       "true ones are in truth.txt [0: true poses]");
    arguments.Optional(
        "--gnss", "SIGMA_M[,SEED[,SHARE]]", gnss_,
        "Write positions.txt, too: where the sensor truly was, with noise of so "
        "much along each axis [SEED 1]; SHARE of its variance stays for half a minute [0.5]");
    arguments.Required("-o,--output", "DIR", directory_, "Folder to write; new or empty");
  }

  Status Run(CommandContext& context) override {
    const auto drive = request_.MakeDrive();
    if (!drive) return drive.error();
    DriveWriteOptions options;
    options.begin = range_.begin;
    options.end = range_.end;
    if (drift_seed_ != 0) options.drift.emplace().seed = drift_seed_;
    if (gnss_) {
      options.gnss.emplace().sigma_m = gnss_->sigma_m;
      options.gnss->seed = gnss_->seed;
      options.gnss->wandering = gnss_->wandering;
    }
    ATLAS_RETURN_IF_ERROR(options.Validate(*drive));
    const std::size_t scans = std::min(drive->scans(), options.end) - options.begin;
    {
      const Interruption interruption;
      ProgressBar bar(context.err, context.is_err_terminal, "simulate", scans);
      const auto on_progress = [&](std::size_t written) {
        bar.Update(written);
        return interruption.Check();
      };
      ATLAS_RETURN_IF_ERROR(WriteDrive(*drive, directory_, on_progress, options));
    }
    const bool is_all = scans == drive->scans();
    const double metres = Rounded(is_all ? drive->length_m() : MetresOf(*drive, options), 3);
    if (context.is_json) {
      context.PrintJson({{"scans", scans}, {"metres", metres}});
    } else {
      context.out << directory_ << ": " << scans << " scans along " << metres << " m\n";
    }
    return {};
  }

 private:
  SimulationRequest request_;
  std::string directory_;
  NumberRange range_;
  std::uint64_t drift_seed_ = 0;
  std::optional<SeededNoise> gnss_;
};

}  // namespace

std::unique_ptr<Command> MakeSimulateCommand() {
  return std::make_unique<SimulateCommand>();
}

}  // namespace atlas
