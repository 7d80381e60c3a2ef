// `atlas simulate`: a drive through a world that is built in or a mesh, as a folder of scans.
#include "client/cli/command_line/interruption.h"
#include "client/cli/commands/drive/drive_commands.h"
#include "client/cli/commands/drive/simulation_request.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/progress_bar.h"
#include "core/simulation/drive_writer.h"

namespace atlas {
namespace {

class SimulateCommand : public Command {
 public:
  std::string Name() const override { return "simulate"; }
  std::string Summary() const override { return "Simulate a drive and write its scans"; }

  void Declare(ArgumentSet& arguments) override {
    request_.Declare(arguments);
    arguments.Required("-o,--output", "DIR", directory_, "Folder to write; new or empty");
  }

  Status Run(CommandContext& context) override {
    const auto drive = request_.MakeDrive();
    if (!drive) return drive.error();
    {
      const Interruption interruption;
      ProgressBar bar(context.err, context.is_err_terminal, "simulate", drive->scans());
      ATLAS_RETURN_IF_ERROR(WriteDrive(*drive, directory_, [&](std::size_t written) {
        bar.Update(written);
        return interruption.Check();
      }));
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
  SimulationRequest request_;
  std::string directory_;
};

}  // namespace

std::unique_ptr<Command> MakeSimulateCommand() {
  return std::make_unique<SimulateCommand>();
}

}  // namespace atlas
