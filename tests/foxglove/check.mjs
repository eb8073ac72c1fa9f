// Reads recordings as Foxglove does: by @mcap/core, with the JSON Schema that each channel carries. Validates every message by ajv, and
// compares what carries one of Foxglove's names with its own definitions in @foxglove/schemas.
//
//   node check.mjs TOOLS FILE.mcap…
//
// TOOLS holds node_modules. Prints one JSON object: messages by schema. Exit code 1: something is not as it must be.

import { deepEqual, ok } from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [tools, ...files] = process.argv.slice(2);
const require = createRequire(path.resolve(tools, "tools.js"));
const { McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");
const foxglove = require("@foxglove/schemas/jsonschema");
const { Ajv2020 } = require("ajv/dist/2020.js");

// Foxglove's definitions, by their titles; that of times stands within its messages.
const known = new Map(Object.values(foxglove).map((schema) => [schema.title, schema]));
known.set("time", foxglove.Log.properties.timestamp);

/** A definition without its words. */
function bare(schema) {
  if (Array.isArray(schema) || typeof schema !== "object" || schema === null) {
    return schema;
  }
  const kept = Object.entries(schema).filter(([key]) => key !== "description" && key !== "$comment");
  return Object.fromEntries(kept.map(([key, value]) => [key, bare(value)]));
}

/** How many parts carry a name of Foxglove's; each must be what it defines. */
function named(schema, at) {
  let count = 0;
  if (schema.title === "time" || schema.title?.startsWith("foxglove.")) {
    deepEqual(bare(schema), bare(known.get(schema.title)), `${at}: ${schema.title}`);
    count += 1;
  }
  for (const [name, property] of Object.entries(schema.properties ?? {})) {
    count += named(property, `${at}.${name}`);
  }
  return count;
}

const ajv = new Ajv2020({ strict: true, allErrors: true });
const counts = {};
for (const file of files) {
  const bytes = readFileSync(file);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => bytes.subarray(Number(offset), Number(offset + length)),
  };
  const reader = await McapIndexedReader.Initialize({
    readable,
    decompressHandlers: await loadDecompressHandlers(),
  });
  const validators = new Map();
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    if (channel.messageEncoding !== "json") {
      continue;
    }
    const schema = reader.schemasById.get(channel.schemaId);
    deepEqual(schema.encoding, "jsonschema", channel.topic);
    if (!validators.has(schema.id)) {
      const described = JSON.parse(new TextDecoder().decode(schema.data));
      ok(named(described, schema.name) >= 1, `${schema.name} has no time`);
      // A field that the schema does not name would be shown without its unit of measure.
      validators.set(schema.id, ajv.compile({ ...described, additionalProperties: false }));
    }
    const validate = validators.get(schema.id);
    const value = JSON.parse(new TextDecoder().decode(message.data));
    ok(validate(value), `${channel.topic}: ${JSON.stringify(validate.errors)}`);
    const { sec, nsec } = value.timestamp;
    deepEqual(BigInt(sec) * 1_000_000_000n + BigInt(nsec), message.publishTime, channel.topic);
    counts[schema.name] = (counts[schema.name] ?? 0) + 1;
  }
}
console.log(JSON.stringify(counts));
