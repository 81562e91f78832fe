/// \file hemowalk schema: JSON Schema of a file format, or the reference page of all.

#include <fmt/format.h>

#include "core/check.hpp"
#include "workflow/campaign.hpp"
#include "workflow/command.hpp"

namespace hemowalk::workflow {

void add_schema(CLI::App& program, Session& session) {
  add_verb(
      program, session, "schema",
      "JSON Schema of a file format, for editors: scene, campaign, coarse, law; or the reference page",
      takes_file,
      [&session] {
        const std::string& name = session.flags.file;
        require(!name.empty(),
                "schema needs the name of a format (scene, campaign, coarse, law, or reference for the page "
                "of all) give one");
        const std::string text = name == "reference" ? reference_page() : format_schema(name);
        fmt::print("{}{}", text, text.empty() || text.back() != '\n' ? "\n" : "");
        return 0;
      },
      "scene, campaign, coarse, law or reference");
}

}  // namespace hemowalk::workflow
