// `atlas simulate`: a drive through a built-in world, written as a folder of scans.
#include "client/cli/commands/drive/drive_commands.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/progress_bar.h"
#include "core/simulation/drive_writer.h"

namespace atlas {
namespace {

Result<SimulatedDrive> MakeDrive(const std::string& world_name,
                                 const std::string& sensor_name,
                                 std::uint64_t seed) {
  const Result<WorldKind> kind = WorldKindByName(world_name);
  if (!kind) return Error(kind.error());
  DriveOptions options;
  Result<LidarSensor> sensor = LidarSensorByName(sensor_name);
  if (!sensor) return Error(sensor.error());
  options.sensor = *std::move(sensor);
  options.seed = seed;
  Result<SimulatedWorld> world = MakeWorld(*kind);
  if (!world) return Error(world.error());
  return SimulatedDrive::Create(*std::move(world), options);
}

class SimulateCommand : public Command {
 public:
  std::string Name() const override { return "simulate"; }
  std::string Summary() const override { return "Simulate a drive and write its scans"; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("WORLD", "street|overpass|garage", world_, "Where the drive goes");
    arguments.Required("-o,--output", "DIR", directory_, "Folder to write; must not exist");
    arguments.Choice("--sensor", {"vlp16", "hdl32", "hdl64", "h350"}, sensor_, "The LiDAR");
    arguments.Optional("--seed", "K", seed_,
                       "Odd: the other direction; also noise, lane and traffic [0]");
  }

  Status Run(CommandContext& context) override {
    const auto drive = MakeDrive(world_, sensor_, seed_);
    if (!drive) return drive.error();
    {
      ProgressBar bar(context.err, context.is_err_terminal, "simulate", drive->scans());
      ATLAS_RETURN_IF_ERROR(
          WriteDrive(*drive, directory_, [&bar](std::size_t written) { bar.Update(written); }));
    }
    const double metres = Rounded(drive->length_m(), 3);
    if (context.is_json) {
      context.PrintJson({{"scans", drive->scans()}, {"metres", metres}});
    } else {
      context.out << directory_ << ": " << drive->scans() << " scans along " << metres << " m\n";
    }
    return {};
  }

 private:
  std::string world_;
  std::string directory_;
  std::string sensor_ = "vlp16";
  std::uint64_t seed_ = 0;
};

}  // namespace

std::unique_ptr<Command> MakeSimulateCommand() {
  return std::make_unique<SimulateCommand>();
}

}  // namespace atlas
