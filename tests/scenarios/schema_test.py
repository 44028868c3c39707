"""Claim: the JSON Schema accepts every shipped scenario and refuses what the reader refuses (refused.yaml), but for the
cases marked as beyond it."""

import json
import pathlib
import sys

import jsonschema
import yaml


class Loader(yaml.SafeLoader):
    """YAML as the reader sees it: `!replace` marks a map and changes nothing else; numbers need no dot before e."""


Loader.add_constructor("!replace", lambda loader, node: loader.construct_mapping(node, deep=True))


def load(path):
    return yaml.load(path.read_text(), Loader)


def main():
    source = pathlib.Path(sys.argv[1])
    schema = json.loads((source / "data/scenario.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    wrong = []

    scenarios = sorted((source / "data/scenarios").glob("*.yaml"))
    if not scenarios:
        wrong.append("no scenarios found")
    for path in scenarios:
        for error in validator.iter_errors(load(path)):
            wrong.append(f"{path.name}: {'.'.join(map(str, error.path))}: {error.message[:200]}")

    table = load(source / "tests/scenarios/refused.yaml")
    if list(validator.iter_errors(table["base"])):
        wrong.append("refused.yaml: the base is refused")
    for number, case in enumerate(table["cases"], 1):
        scenario = dict(table["base"])
        if "remove" in case:
            del scenario[case["remove"]]
        else:
            scenario[case["key"]] = case["value"]
        refused = not validator.is_valid(scenario)
        silent = case.get("schema") == "silent"
        if refused == silent:
            wrong.append(f"refused.yaml, case {number}: {'refused' if refused else 'accepted'} by the schema: {case}")

    print("\n".join(wrong) if wrong else f"{len(scenarios)} scenarios and {len(table['cases'])} refused cases agree")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
