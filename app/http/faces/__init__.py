"""The service as other engines are asked and answer: thin translations over its use cases, one package an engine."""
