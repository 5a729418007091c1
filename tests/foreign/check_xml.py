"""Whether XML files hold to a schema: prints what lxml finds wrong, a line each, and nothing where all is well.

    python check_xml.py SCHEMA.xsd FILE.xml ...
"""

import sys

from lxml import etree


def main(schema, *files):
    rules = etree.XMLSchema(etree.parse(schema))
    for file in files:
        if not rules.validate(etree.parse(file)):
            for error in rules.error_log:
                print(f"{file}: line {error.line}: {error.message}")


if __name__ == "__main__":
    main(*sys.argv[1:])
