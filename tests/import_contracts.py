"""A contract for import-linter that names what a module may import instead of what it may not."""

from __future__ import annotations

import fnmatch

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class OnlyImportsContract(Contract):
    """The source modules, packages with all they hold, import the allowed modules and nothing else, directly.

    A source with a star is a pattern of full module names, in which a star stands for anything, dots too.
    """

    source_modules = fields.SetField(subfield=fields.StringField())
    allowed_modules = fields.SetField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        sources: set[str] = set()
        for source in self.source_modules:
            named = str(source)
            sources |= set(fnmatch.filter(graph.modules, named)) or {named}
        allowed = {str(name) for name in self.allowed_modules}
        broken: list[dict[str, object]] = []
        for source in sorted(sources):
            if source not in graph.modules:
                broken.append({"importer": source, "imported": "", "lines": ""})
                continue
            for importer in sorted({source} | graph.find_descendants(source)):
                for imported in sorted(graph.find_modules_directly_imported_by(importer)):
                    if any(imported == name or imported.startswith(f"{name}.") for name in allowed | sources):
                        continue
                    details = graph.get_import_details(importer=importer, imported=imported)
                    lines = ", ".join(str(detail["line_number"]) for detail in details)
                    broken.append({"importer": importer, "imported": imported, "lines": lines})
        return ContractCheck(kept=not broken, metadata={"broken": broken})

    def render_broken_contract(self, check: ContractCheck) -> None:
        for entry in check.metadata["broken"]:
            if entry["imported"]:
                output.print_error(f"{entry['importer']} imports {entry['imported']} (line {entry['lines']})")
            else:
                output.print_error(f"{entry['importer']} does not exist")
