// `atlas log`: what happened to the atlas beside uploads, and who did it.
#include <array>
#include <ctime>

#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

boost::json::object EventJson(const AtlasEvent& event) {
  return {{"id", event.id},         {"revision", event.revision}, {"time_ms", event.time_ms},
          {"kind", event.kind},     {"author", event.author},     {"subject", event.subject},
          {"detail", event.detail}, {"damaged", event.is_damaged}};
}

// Behind the list: the others are as they were.
Status CheckDamage(std::uint64_t damaged, std::size_t all) {
  if (damaged == 0) return {};
  return {StatusCode::kInvalidData,
          StrCat("log: ", damaged, " of ", all,
                 " events damaged: atlas verify --repair keeps that there were some")};
}

// RFC 3339, UTC.
std::string TimeText(std::int64_t time_ms) {
  const std::time_t seconds = static_cast<std::time_t>(time_ms / 1'000);
  std::tm utc{};
  std::array<char, 32> text{};
  if (gmtime_r(&seconds, &utc) == nullptr ||
      std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc) == 0) {
    return std::to_string(time_ms);
  }
  return text.data();
}

class LogCommand : public Command {
 public:
  std::string Name() const override { return "log"; }
  std::string Summary() const override {
    return "What was done to the atlas beside uploads, when and by whom";
  }

  void Declare(ArgumentSet& arguments) override {
    arguments.Optional("--after", "ID", after_, "Only events behind this one");
  }

  Status Run(CommandContext& context) override {
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    TextTable table({">id", "time", ">revision", "what", "by", "of", "detail"});
    boost::json::array array;
    std::uint64_t damaged = 0;
    for (std::uint64_t after = after_;;) {
      const auto events = client->ListEvents(after);
      if (!events) return events.error();
      if (events->empty()) break;
      for (const AtlasEvent& event : *events) {
        array.push_back(EventJson(event));
        damaged += event.is_damaged ? 1U : 0U;
        table.Row({std::to_string(event.id), event.is_damaged ? "" : TimeText(event.time_ms),
                   event.is_damaged ? "" : std::to_string(event.revision), event.kind, event.author,
                   event.subject, event.detail});
      }
      after = events->back().id;
    }
    const std::size_t all = array.size();
    if (context.is_json) {
      context.PrintJson({{"events", std::move(array)}});
    } else {
      table.Print(context.out);
    }
    return CheckDamage(damaged, all);
  }

 private:
  std::uint64_t after_ = 0;
};

}  // namespace

std::unique_ptr<Command> MakeLogCommand() {
  return std::make_unique<LogCommand>();
}

}  // namespace atlas
