#include "client/cli/commands/atlas/restore_text.h"

#include <algorithm>
#include <filesystem>
#include <ostream>

#include "client/cli/output/text_table.h"

namespace atlas {
namespace {

bool IsLog(const std::filesystem::path& file) {
  return file.native().ends_with("-wal");
}

void PrintLeft(const RestoreSummary& done, std::ostream& out) {
  out << "there was no database; what was left of one is";
  for (const std::filesystem::path& file : done.left) {
    out << (&file == done.left.data() ? " " : " and ") << file.string();
  }
  if (std::any_of(done.left.begin(), done.left.end(), IsLog)) {
    out << ": writes that were acknowledged may be in that log alone";
  }
  out << '\n';
}

void PrintText(const RestoreSummary& done, std::ostream& out) {
  out << HexText(done.sha256) << "  " << done.tiles << " tiles, " << done.keyframes
      << " keyframes of revision " << done.revision << "; now epoch " << done.new_epoch
      << ", revision " << done.new_revision << '\n';
  if (!done.kept.empty()) {
    out << "what was there is " << done.kept.string() << '\n';
  } else if (!done.left.empty()) {
    PrintLeft(done, out);
  }
}

}  // namespace

void PrintRestore(const RestoreSummary& done, const CommandContext& context) {
  if (!context.is_json) {
    PrintText(done, context.out);
    return;
  }
  const bool is_apart = done.kept.empty() && !done.left.empty();
  context.PrintJson({{"backup_revision", done.revision},
                     {"keyframes", done.keyframes},
                     {"tiles", done.tiles},
                     {"bytes", done.bytes},
                     {"digest", HexText(done.sha256)},
                     {"epoch", done.new_epoch},
                     {"revision", done.new_revision},
                     {"kept", (is_apart ? done.left.front() : done.kept).string()}});
}

}  // namespace atlas
